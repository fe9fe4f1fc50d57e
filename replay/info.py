"""Summarise a recording in a few lines: `bunraku info`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from devices.blend_shapes import Blends
from devices.printable import printable
from replay.recording import Recording

GAP_FACTOR = 3.0  # a step of more than this many medians is a gap
MOST_GAPS = 5  # listed gaps, the longest ones
MOST_LISTED = 16  # listed performers
MOST_LETTERS = 300  # of a text from the file


@dataclass(frozen=True, slots=True)
class Gap:
    """A time without a frame of a performer, much longer than the usual step.

    Attributes:
        performer: number of the performer.
        begin: time of the last frame before the gap [s].
        seconds: until the next frame [s].
        missing: approximate number of missing frames.
    """

    performer: int
    begin: float
    seconds: float
    missing: int


def summary(recording: Recording, path: Path, kind: str) -> list[str]:
    """Return lines that describe `recording`, read from `path` in the format called `kind`.

    Rate, jitter and gaps refer to each performer's own frames. Jitter is the 95th percentile of the
    deviation of a step from the median step.
    """
    names = [printable(name) for name in recording.skeleton.names]
    steps = performer_steps(recording)
    gaps = gaps_of(recording)
    lines = [
        f"{printable(path.name)}: {kind}",
        *(
            f"{printable(name, MOST_LETTERS):<11} {printable(text, MOST_LETTERS)}"
            for name, text in sorted(recording.source.items())
        ),
        f"frames      {len(recording)} in {recording.seconds:.3f} s",
        f"rate        {_rate(steps)}",
        f"gaps        {_gaps(gaps)}",
        *(f"            {_gap(gap)}" for gap in _longest(gaps)),
        f"stamps      {_stamps(recording)}",
        f"joints      {len(names)}, root {names[recording.skeleton.root]}: {', '.join(names)}",
        *_performers(recording),
        f"missing     {_missing(recording)}",
        f"size        {_size(recording)}",
        f"rotations   {'none' if recording.rotations is None else 'of every joint'}",
    ]
    if recording.blends is not None:
        lines.append(f"blends      {_blends(recording.blends)}")
    if np.isfinite(recording.arrivals).any():
        lines.append(f"latency     {_latency(recording)}")
    return lines + [f"note        {printable(note)}" for note in recording.notes]


def gaps_of(recording: Recording) -> list[Gap]:
    """Return every gap in order of time: steps longer than three medians of their performer."""
    gaps = []
    for performer in np.unique(recording.performers).tolist():
        times = recording.times[recording.performers == performer]
        steps = np.diff(times)
        rising = steps[steps > 0]
        usual = float(np.median(rising)) if len(rising) else np.inf
        for index in np.flatnonzero(steps > GAP_FACTOR * usual):
            missing = max(round(float(steps[index]) / usual) - 1, 1)
            gaps.append(Gap(performer, float(times[index]), float(steps[index]), missing))
    return sorted(gaps, key=lambda gap: gap.begin)


def stamps_of(recording: Recording) -> tuple[int, int]:
    """Return how many frames repeat the time before, and how many came after a later frame.

    The second number is known only if the file holds arrivals.
    """
    repeated = late = 0
    for performer in np.unique(recording.performers):
        own = recording.performers == performer
        times, arrivals = recording.times[own], recording.arrivals[own]
        repeated += int(np.count_nonzero(np.diff(times) == 0))
        known = np.isfinite(arrivals)
        came = times[known][np.argsort(arrivals[known], kind="stable")]
        late += int(np.count_nonzero(came < np.maximum.accumulate(came)))
    return repeated, late


def performer_steps(recording: Recording) -> NDArray[np.float64]:
    """Return the seconds between consecutive frames of each performer, all performers together."""
    who = recording.performers
    return np.concatenate([np.diff(recording.times[who == one]) for one in np.unique(who)])


def _rate(steps: NDArray[np.float64]) -> str:
    median = float(np.median(steps)) if len(steps) else 0.0
    if median <= 0:
        return "unknown"
    jitter = float(np.percentile(np.abs(steps - median), 95))
    return f"{1.0 / median:.2f} frames/s (median), jitter {1e3 * jitter:.1f} ms"


def _gaps(gaps: list[Gap]) -> str:
    if not gaps:
        return "none"
    return (
        f"{len(gaps)}, the longest {max(gap.seconds for gap in gaps):.3f} s; "
        f"{sum(gap.seconds for gap in gaps):.3f} s in all, "
        f"about {sum(gap.missing for gap in gaps)} frames missing"
    )


def _longest(gaps: list[Gap]) -> list[Gap]:
    kept = sorted(gaps, key=lambda gap: -gap.seconds)[:MOST_GAPS]
    return sorted(kept, key=lambda gap: gap.begin)


def _gap(gap: Gap) -> str:
    return (
        f"from {gap.begin:.3f} s for {gap.seconds:.3f} s, performer {gap.performer}, "
        f"about {gap.missing} frames"
    )


def _stamps(recording: Recording) -> str:
    repeated, late = stamps_of(recording)
    if not (repeated or late):
        return "rising"
    return f"{repeated} repeated, {late} came after a later one"


def _performers(recording: Recording) -> list[str]:
    """The number of performers and, for several, the time span of each."""
    numbers = np.unique(recording.performers).tolist()
    lines = [f"performers  {len(numbers)}"]
    for number in numbers[:MOST_LISTED] if len(numbers) > 1 else []:
        times = recording.times[recording.performers == number]
        lines.append(
            f"            performer {number}: {len(times)} frames, "
            f"{times[0]:.3f} to {times[-1]:.3f} s, {_rate(np.diff(times))}"
        )
    if len(numbers) > MOST_LISTED:
        lines.append(f"            and {len(numbers) - MOST_LISTED} more")
    return lines


def _missing(recording: Recording) -> str:
    missing = ~np.isfinite(recording.positions).all(axis=2)
    if not missing.any():
        return "no joint in any frame"
    by_joint = missing.mean(axis=0)
    worst = int(np.argmax(by_joint))
    return (
        f"{100 * missing.mean():.1f} % of joints; most often "
        f"{printable(recording.skeleton.names[worst])} ({100 * by_joint[worst]:.1f} %)"
    )


def _size(recording: Recording) -> str:
    points = recording.positions[np.isfinite(recording.positions).all(axis=2)]
    if len(points) == 0:
        return "nothing was seen"
    extent = points.max(axis=0) - points.min(axis=0)
    return "moves within " + " x ".join(f"{length:.2f}" for length in extent) + " m"


def _blends(blends: Sequence[Blends | None]) -> str:
    faces = [face for face in blends if face is not None]
    names = sorted({name for face in faces for name in face})
    moving = sum(len({face.get(name) for face in faces}) > 1 for name in names)
    share = 100 * len(faces) / len(blends)
    return (
        f"{len(names)} blend shapes in {share:.0f} % of frames, {moving} of them move: "
        f"{printable(', '.join(names), MOST_LETTERS)}"
    )


def _latency(recording: Recording) -> str:
    late = 1e3 * (recording.arrivals - recording.times)
    late = late[np.isfinite(late)]
    return f"{np.median(late):.1f} ms (median), {np.percentile(late, 99):.1f} ms (99 %)"
