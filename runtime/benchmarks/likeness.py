"""Benchmark: how a character resembles the performer who drives it, limb by limb.

The limbs are found by `plan_by_names` for the performer and by `Character.plan` for the character,
never by what the driver took for them: a wrong pairing shows as a wrong figure. The performer is
measured as recorded, before any conditioning.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

from devices.bodies.joint_labels import label_joints
from devices.bodies.joint_names import Side
from devices.bodies.plan_by_names import plan_by_names
from devices.skeleton import Skeleton
from replay.builtin import builtin_recording
from replay.formats import read_recording
from replay.recording import Recording
from runtime.benchmarks.resemblance.contact_sheet import SIZE, ContactSheet
from runtime.benchmarks.resemblance.ground import ground_figures
from runtime.benchmarks.resemblance.limbs import FOUR, limb_figures, sides
from runtime.benchmarks.resemblance.performance import Performance, perform
from runtime.benchmarks.resemblance.steadiness import jitter
from runtime.benchmarks.resemblance.tips import tip_figures
from runtime.benchmarks.resemblance.turns import finger_curl_kept, hand_roll_kept, head_yaw_kept
from runtime.characters.builtin import BUILTIN
from runtime.characters.character import Character
from runtime.characters.open_character import load_character
from runtime.output.files.whole_file import check_writable, writing
from runtime.show.settings import MatchSettings, ShowSettings


def run(
    recording: Sequence[Path] | None = None,
    character: Sequence[str] | None = None,
    drive: str = "auto",
    sheets: Path | None = None,
) -> dict[str, object]:
    """Print the figures of each recording with each character; return them all.

    Of a recording of several people the first performs.

    Args:
        recording: files to play; None for the built-in show.
        character: meshes, rigs or names; None for the built-in characters.
        drive: how the characters follow: see `MatchSettings.driver`.
        sheets: a folder for a contact sheet of each pair; made if it is not there.

    Raises:
        InputError: a file cannot be read, a pair cannot perform, or a sheet cannot be written.
    """
    clips = [(path.name, read_recording(path)) for path in recording or ()]
    clips = clips or [("built-in show", builtin_recording())]
    cast = [load_character(name) for name in character or BUILTIN]
    pairs = [(name, alone(clip), body) for name, clip in clips for body in cast]
    paths = [None if sheets is None else sheets / _file_name(name, body) for name, _, body in pairs]
    if sheets is not None:
        with writing(sheets):
            sheets.mkdir(parents=True, exist_ok=True)
    for path in paths:
        if path is not None:
            check_writable(path)
    print(f"likeness: {len(pairs)} pairs of recording and character, drive {drive}")
    rows = []
    for (name, clip, body), sheet in zip(pairs, paths, strict=True):
        figures = _measure(clip, body, drive, sheet, name)
        rows.append({"recording": name, "character": body.name, **figures})
        print("\n" + "\n".join(lines(rows[-1])), flush=True)
    return {"drive": drive, "pairs": rows}


def alone(recording: Recording) -> Recording:
    """The frames of the performer who is seen first."""
    return recording.of(int(recording.performers[0]))


def figures_of(performance: Performance, face: tuple[int, int] | None) -> dict[str, Any]:
    """Return all figures of a performance by name; None for what is not known.

    Args:
        performance: to be measured.
        face: the performer's left and right ear or eye, if it has them.
    """
    performer, character = performance.performer, performance.character
    found: dict[str, Any] = {
        "frames": len(performance.positions),
        "surface": asdict(performance.surface),
    }
    if performer is not None and character is not None:
        shaking, source_shaking = jitter(performer, character)
        limbs = limb_figures(performer, character)
        found |= {
            "limbs": {name: asdict(limb) for name, limb in limbs.items()},
            "tips": _tips(performance),
            "ends_kept": performance.ends_kept,
            "sides": sides(performer, character),
            "ground": asdict(
                ground_figures(
                    performer,
                    character,
                    performance.positions,
                    performance.lowest,
                    performance.height,
                )
            ),
            "head_yaw_kept": head_yaw_kept(performer, character, face),
            "hand_roll_kept": hand_roll_kept(performer, character),
            "finger_curl_kept": finger_curl_kept(performer, character),
            "jitter": shaking,
            "performer_jitter": source_shaking,
        }
    known: dict[str, Any] = _known(found)
    return known


def lines(row: dict[str, Any]) -> Iterator[str]:
    """The figures of a pair as lines of text."""
    yield f"{row['recording']} on {row['character']}, {row['frames']} frames"
    if "limbs" in row:
        yield f"  {'limb':<16} {'error':>6} {'kept':>5} {'performer':>9} {'gain':>5}"
        for name, limb in row["limbs"].items():
            yield (
                f"  {name:<16} {_number(limb['error'], 1):>5}° {_number(limb['kept']):>5}"
                f" {_number(limb['range'], 1):>8}° {_number(limb['gain']):>5}"
            )
        yield from _tip_lines(row)
        yield from _body_lines(row)
    else:
        yield "  no limbs to compare: a body is not recognised, or its driver poses no nodes"
    surface = row["surface"]
    yield (
        f"  stretch     mean {surface['stretch_mean']:.3f}, p99 {surface['stretch_p99']:.3f},"
        f" max {surface['stretch_max']:.2f}; {surface['lasting']} triangles stay inverted"
    )
    yield (
        f"  jump        {surface['jump']:.3f} heights in one frame,"
        f" {surface['jump_beyond']:.3f} more than the performer"
    )
    yield f"  tick        p50 {surface['tick_p50']:.2f} ms, p99 {surface['tick_p99']:.2f} ms"


def summary(row: dict[str, Any]) -> list[str]:
    """The figures of a pair in two short lines, for the caption of a sheet."""
    surface = row["surface"]
    first = f"{row['recording']} on {row['character']}, {row['frames']} frames"
    second = f"stretch p99 {surface['stretch_p99']:.2f}, {surface['lasting']} inverted"
    if "limbs" not in row:
        return [first, second]
    ground = row["ground"]
    errors = {
        name: limb["error"]
        for name, limb in row["limbs"].items()
        if name.partition(" ")[2] in (*FOUR, "arm", "leg")
    }
    if errors:
        worst = max(errors, key=lambda name: errors[name])
        first += f": worst limb {worst} {errors[worst]:.1f}°"
    first += "".join(f", {limbs} {side}" for limbs, side in row["sides"].items())
    return [
        first,
        f"travel {_number(ground['travel'])} of {_number(ground['performer_travel'])} leg lengths, "
        f"slide {_number(ground['slide'])}/s, hover {_percent(ground['hover'])}, "
        f"squat {_number(ground['squat'])}, {second}",
    ]


def _measure(
    recording: Recording, character: Character, drive: str, path: Path | None, name: str
) -> dict[str, Any]:
    match = MatchSettings(driver=drive)
    if path is None:
        performance = perform(recording, character, ShowSettings(match=match))
        return figures_of(performance, _face(recording.skeleton))
    sheet = ContactSheet(recording)
    settings = ShowSettings(match=match, pictures=True, plain=True, size=SIZE)
    performance = perform(recording, character, settings, sheet.add)
    figures = figures_of(performance, _face(recording.skeleton))
    row = {"recording": name, "character": character.name, **figures}
    sheet.write(path, summary(row))
    return figures


def _tips(performance: Performance) -> dict[str, dict[str, float]]:
    performer, character, rest = performance.performer, performance.character, performance.rest
    if performer is None or character is None or rest is None:
        return {}
    heights = performance.stature, performance.height
    tips = tip_figures(performer, character, rest, heights)
    return {name: asdict(tip) for name, tip in tips.items()}


def _tip_lines(row: dict[str, Any]) -> Iterator[str]:
    if row["tips"] or row["ends_kept"]:
        yield f"  {'tip':<16} {'seen':>6} {'up':>5} {'aside':>9} {'volume':>6}"
    nothing = dict.fromkeys(("seen", "up", "aside"))
    for name in dict.fromkeys((*row["tips"], *row["ends_kept"])):
        tip = row["tips"].get(name, nothing)
        yield (
            f"  {name:<16} {_number(tip['seen']):>6} {_number(tip['up']):>5}"
            f" {_number(tip['aside']):>9} {_number(row['ends_kept'].get(name)):>6}"
        )


def _body_lines(row: dict[str, Any]) -> Iterator[str]:
    ground = row["ground"]
    told = ", ".join(f"{limbs} {side}" for limbs, side in row["sides"].items())
    yield f"  sides       {told or '-'}"
    yield (
        f"  travel      {_number(ground['travel'])} leg lengths"
        f" (performer {_number(ground['performer_travel'])})"
    )
    yield (
        f"  ground      feet slide {_number(ground['slide'], 3)} leg lengths a second,"
        f" hovers in {_percent(ground['hover'])} of standing frames"
    )
    yield (
        f"  squat       {_number(ground['squat'])} of the performer's"
        f" {_number(ground['performer_squat'])} leg lengths"
    )
    yield (
        f"  kept        head yaw {_number(row['head_yaw_kept'])}, hand roll"
        f" {_number(row['hand_roll_kept'])}, finger curl {_number(row['finger_curl_kept'])}"
    )
    yield (
        f"  jitter      {_number(row['jitter'])} leg lengths / s² while still"
        f" (performer {_number(row['performer_jitter'])})"
    )


def _face(skeleton: Skeleton) -> tuple[int, int] | None:
    """The left and the right ear, or eye; None without them."""
    plan = plan_by_names(skeleton)
    if plan is None:
        return None
    there = {
        (part.word, part.side): joint
        for joint, part in enumerate(label_joints(skeleton))
        if part is not None and not part.tip
    }
    for word in ("ear", "eye"):
        pair = there.get((word, Side.LEFT)), there.get((word, Side.RIGHT))
        if pair[0] is not None and pair[1] is not None:
            return pair[0], pair[1]
    return None


def _file_name(recording: str, character: Character) -> str:
    stem = f"{Path(recording).stem} on {character.name}"
    return re.sub(r"[^\w.-]+", "-", stem) + ".png"


def _known(value: Any) -> Any:
    """The same value with None for each number that is not known."""
    if isinstance(value, dict):
        return {key: _known(item) for key, item in value.items()}
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value


def _number(value: float | None, digits: int = 2) -> str:
    return "-" if value is None else f"{value:.{digits}f}"


def _percent(value: float | None) -> str:
    return "-" if value is None else f"{100.0 * value:.0f} %"
