"""Keeps each performer's number when the sensor gives them a new one.

Sensors number bodies anew whenever they lose one. Performers are remembered for some seconds. A
body that appears near the expected place of one of them, and has the same size, is taken to be that
performer. All bodies of one capture are matched together.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import groupby

import numpy as np
from numpy.typing import NDArray

from devices.bodies.joint_labels import hips_joint
from devices.skeleton import Skeleton, SkeletonFrame
from solvers.signal.association import associate

Array = NDArray[np.float64]

MEMORY = 3.0  # [s] that a lost performer is remembered
NEAR = 0.15  # [m] from the expected place that a performer may be at once
FASTEST = 3.0  # [m/s] further for each second lost
FURTHEST = 1.5  # [m] at most
ALIKE = 0.25  # largest difference of the logarithms of two sizes of one performer
CARRIED_ON = 0.3  # [s] for which a velocity is expected to last
MOST_TRACKS = 64
MOST_NUMBER = 1000  # numbers of a sensor below this are used unchanged


@dataclass(frozen=True, slots=True, eq=False)
class _Track:
    """One performer.

    Attributes:
        number: the steady number.
        name: the sensor's number, -1 for none.
        frame: the newest frame.
        place: (3,) [m] of the hips; None before they were seen.
        velocity: (3,) [m/s] of the hips.
    """

    number: int
    name: int
    frame: SkeletonFrame
    place: tuple[float, float, float] | None
    velocity: tuple[float, float, float] = (0.0, 0.0, 0.0)


@dataclass(frozen=True, slots=True, eq=False)
class IdentitiesState:
    """The tracks of all performers, the longest known first."""

    tracks: tuple[_Track, ...]


class Identities:
    """Gives each performer a steady number.

    Args:
        skeleton: of all frames.
    """

    def __init__(self, skeleton: Skeleton) -> None:
        self._hips = hips_joint(skeleton)
        bones = skeleton.parents >= 0
        self._bones = np.flatnonzero(bones), skeleton.parents[bones]
        self._tracks: dict[int, _Track] = {}  # by number, the longest known first

    def snapshot(self) -> IdentitiesState:
        """Return all tracks."""
        return IdentitiesState(tuple(self._tracks.values()))

    def restore(self, state: IdentitiesState) -> None:
        """Go back to a snapshot."""
        self._tracks = {track.number: track for track in state.tracks}

    def steady(self, frames: Sequence[SkeletonFrame]) -> list[SkeletonFrame]:
        """Return the frames, oldest first, with steady numbers.

        Frames of one time that come together are one capture, whose bodies are matched together.
        """
        return [frame for capture in _captures(frames) for frame in self._name(capture)]

    def _name(self, capture: Sequence[SkeletonFrame]) -> Iterator[SkeletonFrame]:
        time = capture[0].time
        known = [t for t in self._tracks.values() if time - t.frame.time <= MEMORY][-MOST_TRACKS:]
        self._tracks = {track.number: track for track in known}
        places = [self._place(frame) for frame in capture]
        tracks = self._same(capture, places)
        if tracks is None:
            tracks = self._match(capture, places)
        for frame, place, track in zip(capture, places, tracks, strict=True):
            self._follow(track, frame, place)
            number = track.number
            yield frame if frame.performer == number else replace(frame, performer=number)

    def _same(
        self, capture: Sequence[SkeletonFrame], places: Sequence[tuple[float, float, float] | None]
    ) -> list[_Track] | None:
        """The tracks of a capture if all numbers are known and near their places; else None."""
        by_name = {track.name: track for track in self._tracks.values()}
        tracks = []
        for frame, place in zip(capture, places, strict=True):
            track = by_name.get(frame.performer)
            if track is None:
                return None
            gap = frame.time - track.frame.time
            if place is not None and track.place is not None:
                wanted = _carried(track, gap)
                if math.dist(place, wanted) > _reach(gap):
                    return None
            tracks.append(track)
        return tracks

    def _match(
        self, capture: Sequence[SkeletonFrame], places: Sequence[tuple[float, float, float] | None]
    ) -> list[_Track]:
        time, known = capture[0].time, list(self._tracks.values())
        shape = len(capture), len(known)
        distance, within = np.full(shape, FURTHEST), np.zeros(shape, dtype=bool)
        same = np.zeros(shape, dtype=bool)
        for row, (frame, place) in enumerate(zip(capture, places, strict=True)):
            for column, track in enumerate(known):
                same[row, column] = track.name == frame.performer
                gap = time - track.frame.time
                if place is None or track.place is None:
                    continue
                distance[row, column] = math.dist(place, _carried(track, gap))
                near = gap > 0.0 and distance[row, column] <= _reach(gap)
                within[row, column] = near and self._alike(frame, track.frame)
        found = associate(distance, same, within).tolist()
        names = {frame.performer for frame in capture}  # the sensor gives these to others now
        for index, track in enumerate(known):
            if index in found or track.name in names:
                known[index] = self._tracks[track.number] = replace(track, name=-1)
        return [
            known[index] if index >= 0 else self._newcomer(frame)
            for index, frame in zip(found, capture, strict=True)
        ]

    def _newcomer(self, frame: SkeletonFrame) -> _Track:
        number = frame.performer
        if number in self._tracks or not 0 <= number < MOST_NUMBER:
            number = next(n for n in range(len(self._tracks) + 1) if n not in self._tracks)
        track = self._tracks[number] = _Track(number, frame.performer, frame, None)
        return track

    def _follow(
        self, track: _Track, frame: SkeletonFrame, place: tuple[float, float, float] | None
    ) -> None:
        gap, velocity = frame.time - track.frame.time, track.velocity
        if place is not None and track.place is not None and 0.0 < gap < CARRIED_ON:
            (x, y, z), (u, v, w), (a, b, c) = place, track.velocity, track.place
            velocity = (
                0.5 * ((x - a) / gap + u),
                0.5 * ((y - b) / gap + v),
                0.5 * ((z - c) / gap + w),
            )
        elif gap >= CARRIED_ON:
            velocity = 0.0, 0.0, 0.0
        place = track.place if place is None else place
        self._tracks[track.number] = _Track(track.number, frame.performer, frame, place, velocity)

    def _place(self, frame: SkeletonFrame) -> tuple[float, float, float] | None:
        x, y, z = frame.positions[self._hips].tolist()
        if math.isfinite(x + y + z):
            return x, y, z
        seen = frame.positions[np.isfinite(frame.positions).all(axis=1)]
        if not len(seen):
            return None
        x, y, z = seen.mean(axis=0).tolist()
        return x, y, z

    def _alike(self, a: SkeletonFrame, b: SkeletonFrame) -> bool:
        """Return whether two bodies have the same size, by the bones that are seen in both."""
        far, near = self._bones
        ours, theirs = (
            np.linalg.norm(f.positions[far] - f.positions[near], axis=1) for f in (a, b)
        )
        both = np.isfinite(ours + theirs) & (ours > 0.02) & (theirs > 0.02)
        if not both.any():
            return True
        return abs(float(np.median(np.log(ours[both] / theirs[both])))) < ALIKE


def _captures(frames: Sequence[SkeletonFrame]) -> Iterator[list[SkeletonFrame]]:
    """Group frames of one time, with no performer twice in a group."""
    for _, group in groupby(frames, key=lambda frame: frame.time):
        capture: list[SkeletonFrame] = []
        for frame in group:
            if any(other.performer == frame.performer for other in capture):
                yield capture
                capture = []
            capture.append(frame)
        yield capture


def _carried(track: _Track, gap: float) -> tuple[float, float, float]:
    assert track.place is not None
    step = min(max(gap, 0.0), CARRIED_ON)
    (x, y, z), (u, v, w) = track.place, track.velocity
    return x + u * step, y + v * step, z + w * step


def _reach(gap: float) -> float:
    return min(NEAR + FASTEST * max(gap, 0.0), FURTHEST)
