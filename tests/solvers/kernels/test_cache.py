"""Machine code on disk is used again exactly as long as nothing that it is made from changed."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from collections.abc import Callable, Iterator
from importlib import import_module, invalidate_caches
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

from solvers.kernels import cache
from solvers.kernels.cache import KEPT, remove_unused

CHECKOUT = Path(__file__).resolve().parents[3]

SHAPES = """
from typing import NamedTuple
import numpy as np

class Pair(NamedTuple):
    first: np.ndarray
    second: np.ndarray
"""
INNER = '''
from solvers.kernels.compiled import kernel

FACTOR = 10.0

@kernel
def weigh(pair, i):
    """Weigh."""
    return FACTOR * pair.first[i] + pair.second[i]
'''
OUTER = """
from cached_inner import weigh
from solvers.kernels.compiled import kernel

@kernel
def total(pair):
    s = 0.0
    for i in range(len(pair.first)):
        s += weigh(pair, i)
    return s
"""

Load = Callable[[str, str, str], tuple[float, int]]


@pytest.fixture
def load(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Load]:
    """Load three modules that say this; what `total` gives, and how many kernels were compiled."""
    names = ("cached_shapes", "cached_inner", "cached_outer")
    monkeypatch.setattr(cache, "FOLDER", tmp_path / "kernels")
    monkeypatch.setattr(sys, "dont_write_bytecode", True)
    monkeypatch.syspath_prepend(tmp_path)

    def run(shapes: str, inner: str, outer: str) -> tuple[float, int]:
        for name, text in zip(names, (shapes, inner, outer), strict=True):
            sys.modules.pop(name, None)
            (tmp_path / f"{name}.py").write_text(text)
        invalidate_caches()
        modules: list[ModuleType] = [import_module(name) for name in names]
        kinds = [kind for kind in vars(modules[0]).values() if hasattr(kind, "_fields")]
        pair = kinds[0](np.array([1.0, 2.0]), np.array([3.0, 4.0]))
        answer = modules[2].total(pair)
        kernels = (modules[1].weigh, modules[2].total)
        return answer, sum(sum(each.stats.cache_misses.values()) for each in kernels)

    yield run
    for name in names:
        sys.modules.pop(name, None)


def test_the_same_kernels_are_compiled_once(load: Load):
    assert load(SHAPES, INNER, OUTER) == (37.0, 2)
    assert load(SHAPES, INNER, OUTER) == (37.0, 0)


@pytest.mark.parametrize(
    ("old", "new", "answer", "compiled"),
    [
        ("pair.first[i] + ", "pair.first[i] - ", 23.0, 2),  # an inlined callee in another file
        ("10.0", "100.0", 307.0, 2),  # a global of the callee's
        ("s = 0.0", "s = 1.0", 38.0, 1),
        ("first: np.ndarray\n    second", "second: np.ndarray\n    first", 73.0, 2),
        ("class Pair", "class Couple", 37.0, 2),
        ('"""Weigh."""', '"""Weigh one."""\n    # A line more.', 37.0, 0),
        ("import kernel\n\nFACTOR", "import exact_kernel as kernel\n\nFACTOR", 37.0, 2),
    ],
)
def test_what_changed_is_compiled_again(
    load: Load, old: str, new: str, answer: float, compiled: int
):
    texts = SHAPES, INNER, OUTER
    load(*texts)
    assert sum(text.count(old) for text in texts) == 1
    assert load(*(text.replace(old, new) for text in texts)) == (answer, compiled)
    assert load(*texts) == (37.0, 0)  # and what was there before is there still


def test_a_damaged_file_is_replaced(load: Load, tmp_path: Path):
    load(SHAPES, INNER, OUTER)
    for path in (tmp_path / "kernels").iterdir():
        path.write_bytes(path.read_bytes()[:100])
    assert load(SHAPES, INNER, OUTER) == (37.0, 2)
    assert load(SHAPES, INNER, OUTER) == (37.0, 0)


@pytest.mark.parametrize("kind", ["*.nbc", "*.list"])
@pytest.mark.parametrize("left", [b"", bytes(4096), b"\xff" * 100])
def test_what_a_power_cut_leaves_is_compiled_anew(
    load: Load, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, kind: str, left: bytes
):
    monkeypatch.setattr(cache, "_used", set())
    load(SHAPES, INNER, OUTER)
    cache.save_list("part", "")
    assert cache.has_list("part", "")
    for path in (tmp_path / "kernels").glob(kind):
        path.write_bytes(left)
    assert not cache.has_list("part", "")
    assert load(SHAPES, INNER, OUTER) == (37.0, 2 if kind == "*.nbc" else 0)
    cache.save_list("part", "")
    assert cache.has_list("part", "")


def test_a_folder_that_cannot_be_written_is_no_error(load: Load, tmp_path: Path):
    (tmp_path / "kernels").write_text("in the way")
    assert load(SHAPES, INNER, OUTER) == (37.0, 2)


def test_machine_code_that_came_with_the_program_is_used(
    load: Load, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.setattr(cache, "PACKED", tmp_path / "packed")
    load(SHAPES, INNER, OUTER)
    (tmp_path / "kernels").rename(tmp_path / "packed")
    assert load(SHAPES, INNER, OUTER) == (37.0, 0)
    assert not (tmp_path / "kernels").exists()


def test_files_that_nobody_used_for_long_are_removed(load: Load, tmp_path: Path):
    load(SHAPES, INNER, OUTER)
    paths = sorted((tmp_path / "kernels").iterdir())
    for path in paths:
        os.utime(path, (0.0, 0.0))
    assert load(SHAPES, INNER, OUTER) == (37.0, 0)  # a use, of the outer one only
    used = [path for path in paths if path.stat().st_mtime > 0.0]
    assert remove_unused(now=KEPT + 1.0) == len(paths) - len(used) > 0
    assert sorted((tmp_path / "kernels").iterdir()) == used


SOLVE = """
import numpy as np
from solvers.arap import ArapSolver
x = np.stack(np.meshgrid(np.arange(9.0), np.arange(9.0), [0.0]), axis=-1).reshape(-1, 3)
a = (np.arange(8)[:, None] * 9 + np.arange(8)).ravel()
faces = np.concatenate([np.stack([a, a + 1, a + 10], 1), np.stack([a, a + 10, a + 9], 1)])
print(ArapSolver(x, faces, [0, 8, 72]).solve(x[[0, 8, 72]] + [[0, 0, 1], [0, 0, 0], [0, 0, 0]])[40])
"""


def test_breaking_a_kernel_changes_what_uses_it_in_another_file(tmp_path: Path):
    def answer(folder: Path) -> str:
        run = subprocess.run(
            [sys.executable, "-c", SOLVE], cwd=folder, capture_output=True, text=True, check=True
        )
        return run.stdout

    ours = answer(CHECKOUT)
    shutil.copytree(CHECKOUT / "solvers", tmp_path / "solvers")
    assert answer(tmp_path) == ours  # from another folder, with the same machine code
    broken = tmp_path / "solvers" / "deform" / "rotation_fit.py"
    text = broken.read_text()
    assert text.count("    _straighten(lanes, 0, count)\n") == 1
    nothing = "    for k in range(9 * LANES):\n        lanes[_ROTATION + k] = 0.0\n    return\n"
    broken.write_text(text.replace("    _straighten(lanes, 0, count)\n", nothing))
    assert answer(tmp_path) != ours
