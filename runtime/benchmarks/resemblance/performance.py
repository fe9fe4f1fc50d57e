"""Performs a recording with a character and keeps every frame, to be measured."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from devices.bodies.plan_by_names import plan_by_names
from replay.recording import Recording
from runtime.benchmarks.resemblance.body_track import BodyTrack, off_body
from runtime.benchmarks.resemblance.limb_ends import LimbEnds
from runtime.benchmarks.resemblance.steadiness import steps_of_joints
from runtime.characters.character import Character
from runtime.puppet.puppet import Motion
from runtime.show.open_stream import play
from runtime.show.settings import ShowSettings
from runtime.show.show import Show
from solvers.surface.surface_quality import SurfaceQuality

Array = NDArray[np.float64]

LASTING = 10  # frames; a triangle that stays inverted longer is seen


@dataclass(frozen=True, slots=True)
class SurfaceFigures:
    """Figures of the surface and the ticks of a show.

    Attributes:
        stretch_mean, stretch_p99, stretch_max: relative change of edge lengths.
        lasting: triangles that were inverted for more than `LASTING` frames in a row.
        jump: the farthest that a vertex moved from one frame to the next [heights].
        jump_beyond: the same, less the farthest that a joint of the performer moved meanwhile.
        tick_p50, tick_p99: [ms].
    """

    stretch_mean: float
    stretch_p99: float
    stretch_max: float
    lasting: int
    jump: float
    jump_beyond: float
    tick_p50: float
    tick_p99: float


@dataclass(frozen=True, slots=True, eq=False)
class Performance:
    """What is kept of a show, to be measured.

    Attributes:
        performer: as recorded, without any conditioning; None where no body is recognised.
        character: the posed nodes; None where no body is recognised, or no nodes are posed.
        positions: (T, J, 3) [m] of the performer's joints; NaN for those that are not of the body.
        lowest: (T,) [m] height of the character's lowest vertex.
        height: [m] of the character at rest.
        stature: [m] of the performer at rest.
        rest: the character at rest, one frame; None where no body is recognised.
        ends_kept: the share of its volume that the end of each limb keeps: see `LimbEnds.kept`.
        surface: figures of the surface.
    """

    performer: BodyTrack | None
    character: BodyTrack | None
    positions: Array
    lowest: Array
    height: float
    stature: float
    rest: BodyTrack | None
    ends_kept: dict[str, float]
    surface: SurfaceFigures


def perform(
    recording: Recording,
    character: Character,
    settings: ShowSettings | None = None,
    then: Callable[[int, Show], object] = lambda frame, show: None,
) -> Performance:
    """Show a recording of one performer, frame by frame, without a window.

    Args:
        recording: what drives; the show takes every frame of it.
        character: what is driven.
        settings: of the show.
        then: called after each frame with its number and the show.

    Raises:
        InputError: the settings do not fit the character or the performer.
    """
    watch = _SurfaceWatch(character)
    motions: list[Motion] = []
    ends: LimbEnds | None = None
    with Show(play(recording, every_frame=True), [character], settings) as show:
        while not show.ended:
            if show.tick():
                motion = show.motions[0]
                watch.add(motion.vertices)
                ends = ends or _ends(show.puppets[0].character)
                if ends is not None:
                    ends.add(motion.vertices)
                motions.append(Motion(motion.vertices[:0], motion.nodes))
                then(len(motions) - 1, show)
            show.settle()
        report, driven = show.report.summary(), show.puppets[0].character
    ticks, stretch = report["stages_ms"]["frame"], report["stretch"]
    performer = plan_by_names(recording.skeleton)
    steps = np.array(watch.steps)
    positions = recording.positions.copy()
    positions[:, off_body(recording.skeleton)] = np.nan
    beyond = steps - steps_of_joints(positions)[: len(steps)]
    return Performance(
        performer=None
        if performer is None
        else BodyTrack(recording.times, recording.positions, recording.rotations, performer),
        character=_posed(recording.times, driven, motions),
        positions=positions,
        lowest=np.array(watch.lowest),
        height=watch.height,
        stature=float(np.ptp(recording.skeleton.rest_positions[:, 1])),
        rest=None
        if driven.plan is None
        else BodyTrack(np.zeros(1), driven.skeleton.rest_positions[None], None, driven.plan),
        ends_kept={} if ends is None else ends.kept,
        surface=SurfaceFigures(
            stretch_mean=stretch["mean"],
            stretch_p99=stretch["p99"],
            stretch_max=report["watchdog"]["stretch"]["max"],
            lasting=watch.lasting,
            jump=float(steps.max(initial=0.0)),
            jump_beyond=float(beyond.max(initial=0.0)),
            tick_p50=ticks["p50"],
            tick_p99=ticks["p99"],
        ),
    )


def _posed(times: Array, character: Character, motions: list[Motion]) -> BodyTrack | None:
    nodes = [motion.nodes for motion in motions if motion.nodes is not None]
    if character.plan is None or len(nodes) < len(times):
        return None
    positions = np.stack([each.positions for each in nodes])
    rotations = np.stack([each.rotations for each in nodes])
    return BodyTrack(times, positions, rotations, character.plan)


def _ends(character: Character) -> LimbEnds | None:
    if character.plan is None:
        return None
    return LimbEnds(character.vertices, character.faces, character.skeleton.tree, character.plan)


class _SurfaceWatch:
    """Follows the vertices of a character from frame to frame."""

    def __init__(self, character: Character) -> None:
        self._quality = SurfaceQuality(character.vertices, character.faces)
        self._runs = np.zeros(len(self._quality.inverted), np.int64)
        self._longest = self._runs.copy()
        self._last: Array | None = None
        self.height = float(np.ptp(character.vertices[:, 1]))
        self.lowest: list[float] = []
        self.steps: list[float] = []

    def add(self, vertices: Array) -> None:
        self.lowest.append(float(vertices[:, 1].min()))
        if self._last is not None:
            step = float(np.linalg.norm(vertices - self._last, axis=1).max())
            self.steps.append(step / self.height)
        self._last = vertices.copy()
        self._quality.measure(vertices)
        self._runs += 1
        self._runs *= self._quality.inverted
        np.maximum(self._longest, self._runs, out=self._longest)

    @property
    def lasting(self) -> int:
        return int(np.count_nonzero(self._longest > LASTING))
