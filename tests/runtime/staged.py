"""A real show for tests; only the window and the clock of the lights are replaced."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Self

import moderngl
from numpy.typing import NDArray

from devices.stream import SkeletonStream
from runtime.characters.character import Character
from runtime.conditioning.switches import SWITCHES
from runtime.driving.mapping import Mapping
from runtime.output.output import PerformedFrame
from runtime.show.settings import FileSettings, MatchSettings, ShowSettings
from runtime.show.show import Show
from tests.runtime.stick_figures import T_POSE, frame, pose

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


class StagedShow(Show):
    """One character and one performer, whose matches stand until they are accepted.

    Attributes:
        now: what the clock of the lights says [s].
        told: lines for the operator of the show.
        seen: its vertices and pictures.
    """

    def __init__(
        self,
        context: moderngl.Context,
        character: Character,
        stream: SkeletonStream,
        folder: Path,
    ) -> None:
        self.now = 0.0
        self.told: list[str] = []
        self.seen = Seen()
        super().__init__(
            stream,
            [character],
            ShowSettings(
                size=SIZE,
                match=MatchSettings(rehearse=False, patience=math.inf),
                conditioning=dict.fromkeys(SWITCHES, False),
                files=FileSettings(takes=folder / "out.mcap"),
            ),
            outputs=[self.seen],
            context=context,
            clock=lambda: self.now,
            warn=self.told.append,
        )
        (self.act,) = self.acts
        (self.puppet,) = self.puppets
        self.performer, self.match_session = self.act.performer, self.act.match_session
        self.stream, self.loop = stream, self.controls.loop
        self.takes, self.switches = self.controls.takes, self.controls.conditioning
        self.scene = self.controls.scene

    def strike(self, time: float = 0.0) -> Mapping:
        """Let the performer stand in a T pose for a moment; the mapping that is shown."""
        captured = frame(pose(T_POSE), time)
        self.performer.follow(captured)
        self.match_session.direct(captured)
        return self.match_session.mappings[0]
