"""Benchmark: a whole tick of a replay without pictures, stage by stage."""

from __future__ import annotations

from replay.builtin import builtin_recording
from runtime.characters.builtin import BUILTIN, builtin_character
from runtime.show.open_stream import play
from runtime.show.settings import CharacterSettings, ShowSettings
from runtime.show.show import Show

BUDGET_MS = {"p50": 4.0, "p99": 8.0}
ITERATIONS = (1, 2, 3)


def run() -> dict[str, object]:
    """Replay the built-in show on each built-in character; print and return the stage times [ms].

    The first pass over the recording only warms caches.
    """
    print(f"tick: budget {BUDGET_MS['p50']} ms median, {BUDGET_MS['p99']} ms p99, 10k vertices")
    print(
        f"{'character':>10} {'vertices':>8} {'iters':>5} {'frame p50':>10} {'p99':>7} {'deform':>7}"
        f" {'then settle p50':>16} {'p99':>7}"
    )
    figures: dict[str, object] = {}
    for name in BUILTIN:
        for iterations in ITERATIONS:
            stages = _replay(name, iterations)
            vertices = len(builtin_character(name).vertices)
            frame, deform, settle = stages["frame"], stages["deform"], stages["settle"]
            print(
                f"{name:>10} {vertices:>8} {iterations:>5} {frame['p50']:>10.2f}"
                f" {frame['p99']:>7.2f} {deform['p50']:>7.2f} {settle['p50']:>16.2f}"
                f" {settle['p99']:>7.2f}"
            )
            figures[f"{name}, {iterations} iterations"] = stages
    return {"budget_ms": BUDGET_MS, "stages_ms": figures}


def _replay(name: str, iterations: int) -> dict[str, dict[str, float]]:
    """Replay twice, and return the times of the second pass."""
    settings = ShowSettings(characters=(CharacterSettings(iterations=iterations),))
    times: dict[str, dict[str, float]] = {}
    for _ in range(2):
        stream = play(builtin_recording(), every_frame=True)
        with Show(stream, [builtin_character(name)], settings) as show:
            show.run()
            times = show.report.times.summary()
    return times
