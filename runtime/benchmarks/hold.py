"""Benchmark: a frame in which handles are added, removed or weighted differently."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from time import perf_counter
from typing import Any

import numpy as np
from numpy.typing import NDArray

from runtime.characters.builtin import BUILTIN
from runtime.characters.open_character import load_character
from runtime.puppet.puppet import Puppet
from solvers.arap import ArapSolver

FRAME = 16.0  # [ms] allowed for a change together with the iterations of its frame
ITERATIONS = 2
CHANGES = 12

Ints = NDArray[np.int64]


def run() -> dict[str, object]:
    """Print for each character the time of a usual frame and of frames with a change [ms]."""
    print(f"hold: a frame of {ITERATIONS} iterations with a change in it, ms, median / worst")
    print(
        f"{'character':<12} {'vertices':>8} {'usual':>13} {'let go':>13} {'hold':>13} {'weigh':>13}"
    )
    rows = []
    for name in BUILTIN:
        row = _measure(name)
        rows.append(row)
        print(
            f"{name:<12} {row['vertices']:>8} "
            + " ".join(
                f"{row[kind]['p50']:6.2f}/{row[kind]['max']:6.2f}"
                for kind in ("usual", "let_go", "hold", "weigh")
            ),
            flush=True,
        )
    return {"frame_ms": FRAME, "characters": rows}


def _measure(name: str) -> dict[str, Any]:
    character = load_character(name)
    binding = Puppet(character).bound_skeleton.binding
    handles, anchors = binding.handles, binding.anchor
    rest = character.vertices
    solver = ArapSolver(rest, character.faces, handles, groups=anchors)
    out = np.empty_like(rest)
    times: dict[str, list[float]] = {"usual": [], "let_go": [], "hold": [], "weigh": []}

    def timed(kind: str, held: Ints, change: Callable[[], None]) -> None:
        start = perf_counter()
        change()
        solver.solve(rest[held], ITERATIONS, out=out)
        times[kind].append(1e3 * (perf_counter() - start))

    for number in range(-2, CHANGES):  # the first two only touch the memory
        kept = anchors != anchors[(number * 37) % len(anchors)]
        some, groups = handles[kept], anchors[kept]
        timed("usual", handles, lambda: None)
        timed("let_go", some, partial(solver.hold, some, groups=groups))
        timed("hold", handles, partial(solver.hold, handles, groups=anchors))
        weights = np.where(kept, np.inf, 1.0)
        timed("weigh", handles, partial(solver.weigh, weights))
        timed("weigh", handles, partial(solver.weigh, np.full(len(handles), np.inf)))
        if number < 0:
            times = {kind: [] for kind in times}
    return {
        "vertices": len(rest),
        **{
            kind: {"p50": float(np.median(values)), "max": float(np.max(values))}
            for kind, values in times.items()
        },
    }
