"""A whole show in a test's hands: all of it the real thing but the clock and the window."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Self

import moderngl
from numpy.typing import NDArray

from devices.builtin.simulator import Simulator
from replay.playback import playback_of
from replay.player import Player
from replay.recorded_stream import RecordedStream
from replay.recorder import Recorder
from runtime.conditioning.switches import Conditioning
from runtime.control.actions import ShowControls
from runtime.driving.mapping import Mapping
from runtime.driving.match_session import MatchSession
from runtime.driving.performer import Performer
from runtime.driving.puppet_match import Choices
from runtime.output.output import PerformedFrame
from runtime.output.report.report import Report
from runtime.puppet.deformable_surface import Elasticity
from runtime.puppet.puppet import Puppet
from runtime.show.loop import FrameLoop
from runtime.show.scene import Scene
from runtime.show.takes import Takes
from tests.runtime.stick_figures import BODY, FRONT_VIEW, T_POSE, frame, pose

SIZE = (64, 36)


class Seen:
    """An output that keeps vertices and pictures in memory."""

    pictures_a_second = math.inf

    def __init__(self) -> None:
        self.vertices: list[NDArray] = []
        self.pictures: list[NDArray] = []

    def write(self, frame: PerformedFrame) -> None:
        self.vertices.append(frame.vertices.copy())
        if frame.picture is not None:
            self.pictures.append(frame.picture)

    def close(self) -> None: ...

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *exc: object) -> None: ...


class Show:
    """One puppet and one performer, who may be a recording or the simulator.

    Attributes:
        now: what the clock of the lights says [s].
        told: lines for whoever runs the show.
    """

    def __init__(
        self,
        context: moderngl.Context,
        puppet: Puppet,
        stream: Player | Simulator,
        folder: Path,
    ) -> None:
        puppet.rest()
        puppet.surface.elasticity = Elasticity()
        puppet.surface.reset()
        self.now = 0.0
        self.told: list[str] = []
        self.seen = Seen()
        self.puppet = puppet
        self.stream = stream
        recorded = RecordedStream(stream)
        self.performer = Performer(BODY)
        self.match_session = MatchSession(
            self.performer, [puppet], lambda: FRONT_VIEW, Choices(patience=math.inf), [None]
        )
        self.scene = Scene(context, SIZE, [puppet], BODY, clock=lambda: self.now)
        self.switches = Conditioning()
        self.loop = FrameLoop(
            recorded,
            self.performer,
            [puppet],
            match_session=self.match_session,
            report=Report(None),
            scene=self.scene,
            outputs=[[self.seen]],
        )
        self.takes = Takes(
            recorded,
            folder / "out.mcap",
            lambda path: Recorder(path, BODY, tell=self.told.append),
            tell=self.told.append,
            waits=True,
        )
        self.controls = ShowControls(
            cues=self.match_session,
            conditioning=self.switches,
            loop=self.loop,
            surfaces=[puppet.surface],
            takes=self.takes,
            playback=playback_of(recorded),
            scene=self.scene,
        )

    def close(self) -> None:
        self.takes.close()
        self.scene.close()

    def strike(self, time: float = 0.0) -> Mapping:
        """Let the performer stand in a T pose for a moment; the mapping that is shown."""
        captured = frame(pose(T_POSE), time)
        self.performer.follow(captured)
        self.match_session.direct(captured)
        return self.match_session.mappings[0]
