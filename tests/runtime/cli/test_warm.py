"""After a warm-up a show compiles nothing, whatever it is asked for."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

from runtime.cli import warm
from solvers.kernels import cache

CHECKOUT = Path(__file__).resolve().parents[3]

SHOW = """
from numba.core import event
from devices.osc.vmc_decoder import VmcDecoder
from replay.builtin import builtin_recording
from runtime.characters.builtin import BUILTIN, builtin_character
from runtime.characters.proxy import proxy_of
from runtime.cli.warm import use_solvers, warm_up
from runtime.control.actions import ACTIONS
from runtime.show.open_stream import play
from runtime.show.settings import CharacterSettings, ShowSettings
from runtime.show.show import Show
from solvers.arap import ENERGIES

warm_up()
compiled = []

class Heard(event.Listener):
    def on_start(self, event):
        compiled.append(event.data["dispatcher"].py_func.__qualname__)

    def on_end(self, event):
        pass

event.register("numba:compile", Heard())
characters = [builtin_character(name) for name in BUILTIN]
settings = [
    CharacterSettings(energy=energy, cartoon=1.0, volume_gain=1.5, stiffness=0.5)
    for energy in ENERGIES
]
settings += [CharacterSettings()] * (len(characters) - len(settings))
with Show(
    play(builtin_recording("show"), every_frame=True),
    characters,
    ShowSettings(characters=tuple(settings)),
) as show:
    for index in range(12):
        show.tick()
        show.settle()
        if index % 4 == 3:
            ACTIONS["freeze"].press(show.controls)
VmcDecoder()
proxy_of(characters[0], dense=0, count=2_000)
use_solvers()
print("compiled:", *compiled)
"""
MISSED = """
from numba.core.registry import cpu_target
from runtime.cli.warm import _NOT_SHOWN, _SHOW, _SOLVERS, warm_up
from solvers.kernels import cache
from solvers.kernels.fingerprint import _own

warm_up()
lists = [cache.FOLDER / cache._list_name(part, _NOT_SHOWN) for part in (_SOLVERS, _SHOW)]
stems = {name.rpartition("-")[0] for path in lists for name in path.read_text().split()}
kernels = cache._known(_NOT_SHOWN)
called = {callee for kernel in kernels for callee in _own(kernel)[1]}
codegen = cpu_target.target_context.codegen()
missed = [kernel for kernel in kernels if cache._stem(kernel, codegen) not in stems]
print("missed:", *(kernel.py_func.__qualname__ for kernel in missed if kernel not in called))
"""


def test_a_show_compiles_nothing_after_a_warm_up() -> None:
    run = subprocess.run(
        [sys.executable, "-c", SHOW], cwd=CHECKOUT, capture_output=True, text=True, check=False
    )
    assert run.returncode == 0, run.stderr
    assert run.stdout == "compiled:\n"


def test_a_warm_up_uses_every_kernel_that_no_other_kernel_calls() -> None:
    run = subprocess.run(
        [sys.executable, "-c", MISSED], cwd=CHECKOUT, capture_output=True, text=True, check=False
    )
    assert run.returncode == 0, run.stderr
    assert run.stdout == "missed:\n"


def test_every_module_with_kernels_is_loaded_before_its_kernels_are_listed() -> None:
    assert warm.warm_up is not None
    loaded = {kernel.py_func.__module__ for kernel in cache._kernels}
    for room in ("devices", "replay", "runtime", "solvers"):
        for path in sorted((CHECKOUT / room).rglob("*.py")):
            module = ".".join(path.relative_to(CHECKOUT).with_suffix("").parts)
            has_kernels = any(line.endswith("kernel") for line in decorators(path))
            if has_kernels and module not in NOT_FOR_SHOWS:
                assert module in loaded, module


NOT_FOR_SHOWS = {"runtime.benchmarks.arap", "solvers.kernels.array_vectors"}


def decorators(path: Path) -> list[str]:
    return [line for line in path.read_text(encoding="utf-8").splitlines() if line[:1] == "@"]
