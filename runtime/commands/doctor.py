"""`bunraku doctor`: what is wrong with this machine, and what to do about it."""

from __future__ import annotations

import argparse
import importlib
import os
import platform
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np

from devices.errors import InputError
from replay.builtin import builtin_recording
from replay.player import EveryFrame, Player
from runtime.characters.builtin import BUILTIN, builtin_character
from runtime.characters.cache import cache_folder
from runtime.characters.proxy import proxy_of
from runtime.director import Choices, Director
from runtime.loop import FrameLoop
from runtime.output.report import Report
from runtime.output.video import encoder_for
from runtime.performer import Performer
from runtime.puppet import Puppet
from runtime.render.context import headless_context, is_software, release_headless, renderer_name
from runtime.skin import Elasticity
from runtime.theatre import Theatre

EXTRAS = {
    "characters": ("pygel3d", "fast_simplification", "manifold3d"),
    "video": ("av",),
    "usd": ("pxr",),
    "camera": ("pyvirtualcam",),
    "ndi": ("cyndilib",),
    "bench": ("igl",),
}
WARM_FRAMES = 3

Check = Callable[[], str]


def doctor(options: argparse.Namespace) -> int:
    """Print a line for each thing that a show needs; the exit code is 0 when all is well."""
    wrong = 0
    for name, check in CHECKS.items():
        try:
            print(f"ok       {name:<12} {check()}")
        except (InputError, OSError) as error:
            wrong += 1
            print(f"WRONG    {name:<12} {error}")
    for extra, modules in EXTRAS.items():
        print(_extra(extra, modules))
    if options.warm:
        _warm()
        print("ok       warm         the solvers and the renderer are compiled")
    return 1 if wrong else 0


def _python() -> str:
    if not (3, 11) <= sys.version_info[:2] <= (3, 13):
        raise InputError(f"Python {platform.python_version()}: install Python 3.11, 3.12 or 3.13")
    return f"{platform.python_version()} on {platform.system()} {platform.machine()}"


def _headless() -> str:
    context = headless_context()
    try:
        kind = "software" if is_software(context) else "hardware"
        return f"{renderer_name(context)} ({kind})"
    finally:
        release_headless(context)


def _display() -> str:
    if not sys.platform.startswith("linux"):
        return "native"
    shown = os.environ.get("WAYLAND_DISPLAY") or os.environ.get("DISPLAY")
    return shown or "none: shows go on with --headless"


def _cache() -> str:
    folder: Path = cache_folder()
    folder.mkdir(parents=True, exist_ok=True)
    if not os.access(folder, os.W_OK):
        raise InputError(f"{folder} cannot be written: skeletons are extracted anew every time")
    return str(folder)


def _video() -> str:
    return encoder_for(Path("out.mp4"))


CHECKS: dict[str, Check] = {
    "python": _python,
    "headless GL": _headless,
    "display": _display,
    "cache": _cache,
    "video": _video,
}


def _extra(extra: str, modules: tuple[str, ...]) -> str:
    missing = []
    for module in modules:
        try:
            importlib.import_module(module)
        except (ImportError, OSError):  # OSError: a system library that the module needs
            missing.append(module)
    if missing:
        hint = f"pip install 'bunraku[{extra}]'"
        return f"missing  {extra:<12} {', '.join(missing)}: {hint}"
    return f"ok       {extra:<12} {', '.join(modules)}"


def _warm() -> None:
    """Perform a few frames with every built-in character, so that nothing is compiled in a show."""
    recording = builtin_recording()
    performer = Performer(recording.skeleton)
    puppets = [Puppet(builtin_character(name)) for name in BUILTIN]
    proxy_of(puppets[0].character, dense=0, count=1_000)  # as for a dense character
    puppets[0].skin.elasticity = Elasticity(cartoon=1.0, volume_gain=1.5, stiffness=0.5)
    anchors = len(puppets[1].binding.node)
    puppets[1].skin.weigh(np.ones(anchors))  # as of a limb that lets go
    context = headless_context()
    theatre = Theatre(context, (320, 180), puppets, recording.skeleton)
    report = Report(None)
    loop = FrameLoop(
        Player(recording, EveryFrame()),
        performer,
        puppets,
        director=Director(
            performer,
            puppets,
            lambda: theatre.camera.view_rotation,
            Choices(),
            [None] * len(puppets),
        ),
        report=report,
        theatre=theatre,
        outputs=[[report.cast(puppet.character)] for puppet in puppets],
        shown=True,
    )
    for _ in range(WARM_FRAMES):
        loop.tick()
    theatre.close()
    release_headless(context)
