"""Benchmark: whole performances; the time of their ticks and the quality of the surfaces.

Every clip drives every character, as `bunraku replay --fast` does, without pictures. A line shows
the worst character of a clip: tick times, the 99th percentile of edge stretch over all frames, and
inverted triangles, at the end and the longest (`runtime.output.report.watchdog`).
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from time import perf_counter
from typing import Any

from devices.builtin.motions import MOTIONS
from replay.builtin import builtin_recording
from replay.formats import read_recording
from replay.recording import Recording
from runtime.characters.builtin import BUILTIN
from runtime.characters.character import Character
from runtime.characters.open_character import load_character
from runtime.show.open_stream import play
from runtime.show.show import Show

FRAME_MS = 16.0  # the longest tick that is allowed


def run(
    recording: Sequence[Path] | None = None, character: Sequence[str] | None = None
) -> dict[str, object]:
    """Print a line for each clip and return the figures of every clip and character.

    Args:
        recording: files to play; None for the built-in motions.
        character: meshes or names; None for the built-in characters.
    """
    clips = [(path.name, read_recording(path)) for path in recording or ()]
    clips = clips or [(act, builtin_recording(act)) for act in MOTIONS]
    cast = [(name, load_character(name)) for name in character or BUILTIN]
    print(f"clips: worst of {len(cast)} characters; no tick may take {FRAME_MS:g} ms")
    print(
        f"{'clip':<34} {'frames':>6} {'tick p50':>8} {'p99':>6} {'max':>6} {'over':>5}"
        f" {'stretch p99':>11} {'inverted at end':>15} {'longest':>8}"
    )
    figures = {}
    for name, clip in clips:
        rows = {who: _perform(clip, body) for who, body in cast}
        figures[name] = rows
        worst = {key: max(row[key] for row in rows.values()) for key in next(iter(rows.values()))}
        print(
            f"{name[:34]:<34} {len(clip):>6} {worst['p50']:8.2f} {worst['p99']:6.2f}"
            f" {worst['max']:6.2f} {worst['over']:5d} {worst['stretch_p99']:11.3f}"
            f" {worst['inverted_last']:15d} {worst['inverted_longest']:8d}",
            flush=True,
        )
    return {"frame_ms": FRAME_MS, "clips": figures}


def _perform(recording: Recording, character: Character) -> dict[str, Any]:
    over = 0
    with Show(play(recording, every_frame=True), [character]) as show:
        while not show.ended:
            start = perf_counter()
            show.tick()
            show.settle()
            over += 1e3 * (perf_counter() - start) > FRAME_MS
        figures = show.report.summary()
    watchdog = figures["watchdog"]
    return {
        "vertices": len(character.vertices),
        **figures["stages_ms"]["frame"],
        "over": over,
        "stretch_p99": figures["stretch"]["p99"],
        "inverted_last": watchdog["inverted"]["last"],
        "inverted_longest": watchdog["inverted"]["longest"],
    }
