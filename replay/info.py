"""What is in a recording, in a few lines for people: `bunraku info`."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from replay.recording import Recording

GAP_FACTOR = 3.0  # a step this many medians long is a gap


def summary(recording: Recording, path: Path, kind: str) -> list[str]:
    """Lines on `recording`, which was read from `path` as the format called `kind`.

    Rate, jitter and gaps are of each performer's own frames. Jitter is the 95th percentile of how
    far a step is from the median step.
    """
    names = recording.skeleton.names
    steps = performer_steps(recording)
    lines = [
        f"{path.name}: {kind}",
        f"frames      {len(recording)} in {recording.seconds:.3f} s",
        f"rate        {_rate(steps)}",
        f"gaps        {_gaps(steps)}",
        f"joints      {len(names)}, root {names[recording.skeleton.root]}: {', '.join(names)}",
        f"performers  {len(np.unique(recording.performers))}",
        f"missing     {_missing(recording)}",
        f"size        {_size(recording)}",
        f"rotations   {'none' if recording.rotations is None else 'of every joint'}",
    ]
    if np.isfinite(recording.arrivals).any():
        lines.append(f"latency     {_latency(recording)}")
    return lines + [f"note        {note}" for note in recording.notes]


def performer_steps(recording: Recording) -> NDArray[np.float64]:
    """Seconds between one frame and the next of the same performer, all performers together."""
    who = recording.performers
    return np.concatenate([np.diff(recording.times[who == one]) for one in np.unique(who)])


def _rate(steps: NDArray[np.float64]) -> str:
    median = float(np.median(steps)) if len(steps) else 0.0
    if median <= 0:
        return "unknown"
    jitter = float(np.percentile(np.abs(steps - median), 95))
    return f"{1.0 / median:.2f} frames/s (median), jitter {1e3 * jitter:.1f} ms"


def _gaps(steps: NDArray[np.float64]) -> str:
    median = float(np.median(steps)) if len(steps) else 0.0
    gaps = steps[steps > GAP_FACTOR * median] if median > 0 else steps[:0]
    return "none" if len(gaps) == 0 else f"{len(gaps)}, the longest {gaps.max():.3f} s"


def _missing(recording: Recording) -> str:
    missing = ~np.isfinite(recording.positions).all(axis=2)
    if not missing.any():
        return "no joint in any frame"
    by_joint = missing.mean(axis=0)
    worst = int(np.argmax(by_joint))
    return (
        f"{100 * missing.mean():.1f} % of joints; most often "
        f"{recording.skeleton.names[worst]} ({100 * by_joint[worst]:.1f} %)"
    )


def _size(recording: Recording) -> str:
    points = recording.positions[np.isfinite(recording.positions).all(axis=2)]
    if len(points) == 0:
        return "nothing was seen"
    extent = points.max(axis=0) - points.min(axis=0)
    return "moves within " + " x ".join(f"{length:.2f}" for length in extent) + " m"


def _latency(recording: Recording) -> str:
    late = 1e3 * (recording.arrivals - recording.times)
    late = late[np.isfinite(late)]
    return f"{np.median(late):.1f} ms (median), {np.percentile(late, 99):.1f} ms (99 %)"
