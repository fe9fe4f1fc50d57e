"""Sample an animation of a glTF file: the translation, rotation and scale of its nodes over time.

Source: Khronos, "glTF 2.0 Specification", section 3.11 and appendix C (interpolation).
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from devices.errors import ContentError
from devices.printable import printable
from replay.bounds import MOST_POSES
from replay.gltf.checked_json import Entry
from replay.gltf.file import GltfFile

Array = NDArray[np.float64]

PATHS = {"translation": 3, "rotation": 4, "scale": 3}
"""What of a node is animated, and its numbers; weights of morph targets are no motion of joints."""

MOST_CHANNELS = 100_000
_MOST_NAMED = 24  # animations in a line
_MOST_LETTERS = 60
_LATEST = 1e6  # [s] of a key
_USUAL_RATE = 60.0
_SAME = 1e-5  # [s] between keys of one frame
_EVEN = 0.02  # of a step by which even keys differ
_RATES = (10.0, 1000.0)  # plausible rates of keys that were sampled from a motion


@dataclass(frozen=True, slots=True, eq=False)
class Track:
    """The keys of one property of one node.

    Attributes:
        times: (K,) [s], rising.
        values: (K, w); of a cubic spline (K, 3, w): incoming tangent, value, outgoing tangent.
        way: STEP, LINEAR or CUBICSPLINE.
    """

    times: Array
    values: Array
    way: str

    def at(self, times: Array) -> Array:
        """The values (T, w) at given times; before and after all keys those of the nearest one.

        Rotations, which have four numbers, are unit quaternions.
        """
        after = np.clip(np.searchsorted(self.times, times, side="right"), 1, len(self.times) - 1)
        if len(self.times) == 1:
            after = np.zeros(len(times), dtype=np.int64)
        before = np.maximum(after - 1, 0)
        step = self.times[after] - self.times[before]
        share = np.divide(
            times - self.times[before], step, out=np.zeros_like(times), where=step > 0
        )
        share = np.clip(share, 0.0, 1.0)[:, None]
        if self.way == "STEP":
            held: Array = self.values[np.where(share[:, 0] >= 1.0, after, before)]
            return _unit(held) if held.shape[1] == 4 else held
        if self.way == "CUBICSPLINE":
            blended = self._hermite(before, after, share, step[:, None])
            return _unit(blended) if blended.shape[1] == 4 else blended
        first, second = self.values[before], self.values[after]
        if first.shape[1] == 4:
            return _slerp(_unit(first), _unit(second), share)
        blended = (1.0 - share) * first + share * second
        between: Array = np.where(share >= 1.0, second, np.where(share > 0.0, blended, first))
        return between

    def _hermite(
        self, before: NDArray[np.int64], after: NDArray[np.int64], t: Array, step: Array
    ) -> Array:
        start, leaving = self.values[before, 1], self.values[before, 2]
        end, arriving = self.values[after, 1], self.values[after, 0]
        squared, cubed = t * t, t * t * t
        curve: Array = (
            (2 * cubed - 3 * squared + 1) * start
            + step * (cubed - 2 * squared + t) * leaving
            + (3 * squared - 2 * cubed) * end
            + step * (cubed - squared) * arriving
        )
        return curve


@dataclass(frozen=True, slots=True, eq=False)
class Animation:
    """One animation of a file.

    Attributes:
        name: as the file has it; perhaps empty.
        tracks: by node and path.
    """

    name: str
    tracks: dict[tuple[int, str], Track] = field(default_factory=dict)

    @property
    def nodes(self) -> set[int]:
        """The nodes that are animated."""
        return {node for node, _ in self.tracks}

    @property
    def seconds(self) -> float:
        """From the first key to the last [s]."""
        ends = [(track.times[0], track.times[-1]) for track in self.tracks.values()]
        return float(max(end for _, end in ends) - min(start for start, _ in ends))

    def times(self) -> Array:
        """The times (T,) [s] at which it is sampled: its own even keys, or 60 a second.

        Raises:
            ContentError: there would be too many.
        """
        keys = np.unique(np.concatenate([track.times for track in self.tracks.values()]))
        keys = keys[np.diff(keys, prepend=-np.inf) > _SAME]
        steps = np.diff(keys)
        if not len(steps):
            return keys
        step = float(np.median(steps))
        even = (np.abs(steps - step) <= _EVEN * step).mean() > 0.9
        if even and _RATES[0] <= 1.0 / step <= _RATES[1]:
            return keys
        span = float(keys[-1] - keys[0])
        check_size(span * _USUAL_RATE, len(self.nodes))
        every: Array = keys[0] + np.arange(int(span * _USUAL_RATE + 1e-6) + 1) / _USUAL_RATE
        return every


def animations(file: GltfFile) -> list[Animation]:
    """Return every animation of a file that moves a node.

    Raises:
        ContentError: one is damaged.
    """
    found = []
    for entry in file.entries("animations"):
        samplers = entry.children("samplers")
        read: dict[tuple[int, int], Track] = {}
        animation = Animation(entry.text("name", ""))
        channels = entry.children("channels")
        if len(channels) > MOST_CHANNELS:
            raise entry.wrong(f"it has more than {MOST_CHANNELS} channels")
        for channel in channels:
            target = channel.child("target")
            path = "" if target is None else target.text("path", "")
            if target is None or path not in PATHS or "node" not in target:
                continue  # weights of morph targets, or of an extension
            node = target.whole("node", below=len(file.entries("nodes")))
            number, width = channel.whole("sampler", below=len(samplers)), PATHS[path]
            if (number, width) not in read:
                read[number, width] = _track(file, samplers[number], width)
            animation.tracks[node, path] = read[number, width]
        if animation.tracks:
            found.append(animation)
    return found


def _track(file: GltfFile, sampler: Entry, width: int) -> Track:
    way = sampler.text("interpolation", "LINEAR")
    if way not in ("STEP", "LINEAR", "CUBICSPLINE"):
        raise sampler.wrong("its interpolation is none of glTF's")
    times = file.floats(sampler.whole("input"), "SCALAR")[:, 0]
    values = file.floats(sampler.whole("output"), f"VEC{width}")
    triple = 3 if way == "CUBICSPLINE" else 1
    if not len(times) or len(values) != triple * len(times):
        raise sampler.wrong(f"it has {len(times)} times and {len(values)} values")
    if not (np.abs(times) <= _LATEST).all() or not (np.diff(times) >= 0.0).all():
        raise sampler.wrong("its times do not rise, or are no seconds")
    return Track(times, values.reshape(len(times), 3, width) if triple == 3 else values, way)


def chosen(found: list[Animation], wanted: str | None) -> Animation:
    """Return the animation of a name or a number from 1; the first that moves where None is given.

    An animation moves if it has more than one key.

    Raises:
        ContentError: there is none, or none that is wanted; the message lists them.
    """
    if not found:
        raise ContentError("it holds no animation of nodes; name it as a character")
    if wanted is None:
        return next((one for one in found if len(one.times()) > 1), found[0])
    for one in found:
        if one.name == wanted:
            return one
    if wanted.isdecimal() and 0 < int(wanted[:9]) <= len(found):
        return found[int(wanted) - 1]
    alike = [one for one in found if one.name.strip().lower() == wanted.strip().lower()]
    if len(alike) != 1:
        raise ContentError(f"it has no animation {wanted!r:.60}; it has {listed(found)}")
    return alike[0]


def listed(found: list[Animation], leave_out: Animation | None = None) -> str:
    """The animations of a file in a line: "1 'walk' (2.0 s), 2 'run' (1.5 s)"."""
    each = [
        f"{number} {printable(one.name, _MOST_LETTERS)!r} ({one.seconds:.1f} s)"
        for number, one in enumerate(found, 1)
        if one is not leave_out
    ]
    return ", ".join(each[:_MOST_NAMED]) + (", ..." if len(each) > _MOST_NAMED else "")


def check_size(frames: float, nodes: int) -> None:
    """Refuse more frames of so many nodes than are sampled; each takes a matrix as well.

    Raises:
        ContentError: there are too many.
    """
    if 2 * frames * nodes > MOST_POSES:
        raise ContentError(
            f"{frames:.0f} frames of {nodes} nodes are too many; split the animation"
        )


def _unit(quaternions: Array) -> Array:
    length = np.linalg.norm(quaternions, axis=1, keepdims=True)
    unit: Array = np.divide(
        quaternions, length, out=np.full_like(quaternions, np.nan), where=length > 1e-9
    )
    return unit


def _slerp(first: Array, second: Array, share: Array) -> Array:
    """Unit quaternions (T, 4) a share (T, 1) of the shorter way from the first to the second."""
    cosine = (first * second).sum(axis=1, keepdims=True)
    second = np.where(cosine < 0.0, -second, second)
    angle = np.arccos(np.clip(np.abs(cosine), 0.0, 1.0))
    sine = np.sin(angle)
    close = sine < 1e-6
    wide = np.where(close, 1.0, sine)
    a = np.where(close, 1.0 - share, np.sin((1.0 - share) * angle) / wide)
    b = np.where(close, share, np.sin(share * angle) / wide)
    between = np.where(share > 0.0, _unit(a * first + b * second), first)
    turned: Array = np.where(share >= 1.0, second, between)
    return turned
