"""A loop of acts over frames in memory, and outputs that keep what they are given."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace
from typing import Self

from devices.skeleton import SkeletonFrame
from replay.player import Player
from replay.recorded_stream import RecordedStream
from replay.recording import Recording
from runtime.conditioning.switches import Conditioning
from runtime.driving.choices import Choices
from runtime.driving.mapping import Mapping
from runtime.driving.match_session import MatchSession
from runtime.driving.performer import Performer
from runtime.output.output import PerformedFrame
from runtime.output.report.report import Report
from runtime.puppet.puppet import Puppet
from runtime.show.act_group import Act
from runtime.show.loop import FrameLoop
from runtime.show.scene import Scene
from tests.runtime.stick_figures import (
    ARMS,
    BODY,
    FRONT_VIEW,
    pose,
    record,
    waving,
)


class Kept:
    """An output that keeps all in memory."""

    def __init__(self, pictures_a_second: float = 0.0, log: list[str] | None = None) -> None:
        self.pictures_a_second = pictures_a_second
        self.frames: list[PerformedFrame] = []
        self.log = log if log is not None else []

    def write(self, frame: PerformedFrame) -> None:
        self.frames.append(replace(frame, vertices=frame.vertices.copy()))
        self.log.append(f"{id(self)}:{frame.index}")

    def close(self) -> None: ...

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *exc: object) -> None: ...

    @property
    def pictured(self) -> list[float]:
        return [frame.time for frame in self.frames if frame.picture is not None]


class Tape:
    """A recorder in memory."""

    def __init__(self) -> None:
        self.frames: list[SkeletonFrame] = []

    def write(self, frame: SkeletonFrame) -> None:
        self.frames.append(frame)


class Wire:
    """A live source that gives these frames, one a poll, as they are."""

    skeleton = BODY

    def __init__(self, frames: list[SkeletonFrame]) -> None:
        self._frames = frames

    @property
    def ended(self) -> bool:
        return not self._frames

    def poll(self) -> list[SkeletonFrame]:
        return [self._frames.pop(0)] if self._frames else []

    def close(self) -> None: ...

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *exc: object) -> None: ...


def loop_of(  # what every show needs, with what a test cares for
    player: Player | Wire,
    puppets: list[Puppet],
    outputs: list[list[Kept]],
    *,
    report: Report | None = None,
    scene: Scene | None = None,
    recorder: Tape | None = None,
    conditioning: Conditioning | None = None,
    shown: bool = False,
    clock: Callable[[], float] = time.monotonic,
) -> FrameLoop:
    for puppet in puppets:
        puppet.rest()
        puppet.surface.reset()
    performer = Performer(BODY)
    hands = [Mapping(ARMS)] * len(puppets)
    match_session = MatchSession(performer, puppets, lambda: FRONT_VIEW, Choices(), hands)
    return FrameLoop(
        player if recorder is None else RecordedStream(player, recorder.write),
        [Act(performer, puppets, match_session)],
        report=report or Report(None),
        scene=scene,
        outputs=outputs,
        conditioning=conditioning,
        shown=shown,
        clock=clock,
    )


def play(loop: FrameLoop, player: Player | Wire) -> int:
    ticks = 0
    while not player.ended:
        ticks += loop.tick()
    return ticks


def two_performers(count: int) -> Recording:
    """A performer who waves and a second one who stands, frame by frame in turn."""
    poses = [still for moving in waving(count) for still in (moving, pose())]
    return record(poses, rate=20.0, performers=[4, 9] * count)
