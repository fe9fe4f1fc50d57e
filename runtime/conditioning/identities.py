"""Steady identities: who comes back under a new number is known by where they are and their size.

Sensors number bodies anew whenever they lose one. Whoever was seen within the last seconds is
remembered; a body that appears near where somebody should be by now, of the same size, is that
somebody. All bodies of one capture are matched together.
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

MEMORY = 3.0  # [s] that somebody who is gone is remembered
NEAR = 0.15  # [m] from the place expected, at once
FASTEST = 3.0  # [m/s] further for each second gone
FURTHEST = 1.5  # [m] at most
ALIKE = 0.25  # of the logarithm of two bodies' sizes
CARRIED_ON = 0.3  # [s] that a walk is expected to go on
MOST_TRACKS = 64
MOST_NUMBER = 1000  # of a sensor that is used as it is


@dataclass(slots=True)
class _Track:
    """One person: the steady number, the sensor's, newest frame, the hips' place and velocity."""

    number: int
    name: int
    frame: SkeletonFrame
    place: tuple[float, float, float] | None
    velocity: tuple[float, float, float] = (0.0, 0.0, 0.0)


class Identities:
    """Gives each performer a number that stays.

    Args:
        skeleton: of all frames.
    """

    def __init__(self, skeleton: Skeleton) -> None:
        self._hips = hips_joint(skeleton)
        bones = skeleton.parents >= 0
        self._bones = np.flatnonzero(bones), skeleton.parents[bones]
        self._tracks: list[_Track] = []

    def steady(self, frames: Sequence[SkeletonFrame]) -> list[SkeletonFrame]:
        """The frames, oldest first, with steady numbers.

        Frames of one time that come together are one capture and matched together.
        """
        return [frame for capture in _captures(frames) for frame in self._name(capture)]

    def _name(self, capture: Sequence[SkeletonFrame]) -> Iterator[SkeletonFrame]:
        time = capture[0].time
        self._tracks = [t for t in self._tracks if time - t.frame.time <= MEMORY][-MOST_TRACKS:]
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
        """Who they are where everybody is known and near where they were: nearly always."""
        by_name = {track.name: track for track in self._tracks}
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
        time = capture[0].time
        shape = len(capture), len(self._tracks)
        distance, within = np.full(shape, FURTHEST), np.zeros(shape, dtype=bool)
        same = np.zeros(shape, dtype=bool)
        for row, (frame, place) in enumerate(zip(capture, places, strict=True)):
            for column, track in enumerate(self._tracks):
                same[row, column] = track.name == frame.performer
                gap = time - track.frame.time
                if place is None or track.place is None:
                    continue
                distance[row, column] = math.dist(place, _carried(track, gap))
                near = gap > 0.0 and distance[row, column] <= _reach(gap)
                within[row, column] = near and self._alike(frame, track.frame)
        found = associate(distance, same, within).tolist()
        known = list(self._tracks)
        for index in found:  # a number now borne by another is nobody's
            if index >= 0:
                known[index].name = -1
        names = {frame.performer for frame in capture}
        for track in known:
            track.name = -1 if track.name in names else track.name
        return [
            known[index] if index >= 0 else self._newcomer(frame)
            for index, frame in zip(found, capture, strict=True)
        ]

    def _newcomer(self, frame: SkeletonFrame) -> _Track:
        taken = {track.number for track in self._tracks}
        number = frame.performer
        if number in taken or not 0 <= number < MOST_NUMBER:
            number = next(n for n in range(len(taken) + 1) if n not in taken)
        track = _Track(number, frame.performer, frame, None)
        self._tracks.append(track)
        return track

    def _follow(
        self, track: _Track, frame: SkeletonFrame, place: tuple[float, float, float] | None
    ) -> None:
        gap = frame.time - track.frame.time
        if place is not None and track.place is not None and 0.0 < gap < CARRIED_ON:
            (x, y, z), (u, v, w), (a, b, c) = place, track.velocity, track.place
            track.velocity = (
                0.5 * ((x - a) / gap + u),
                0.5 * ((y - b) / gap + v),
                0.5 * ((z - c) / gap + w),
            )
        elif gap >= CARRIED_ON:
            track.velocity = 0.0, 0.0, 0.0
        track.place = track.place if place is None else place
        track.name, track.frame = frame.performer, frame

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
        """Whether two bodies are of one size, as far as both are seen."""
        far, near = self._bones
        ours, theirs = (
            np.linalg.norm(f.positions[far] - f.positions[near], axis=1) for f in (a, b)
        )
        both = np.isfinite(ours + theirs) & (ours > 0.02) & (theirs > 0.02)
        if not both.any():
            return True
        return abs(float(np.median(np.log(ours[both] / theirs[both])))) < ALIKE


def _captures(frames: Sequence[SkeletonFrame]) -> Iterator[list[SkeletonFrame]]:
    """Frames of one time, as long as no performer occurs twice among them."""
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
