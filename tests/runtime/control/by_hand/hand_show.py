"""A show of a recording in which pairs can be clicked, and where everything is in its picture."""

from __future__ import annotations

from collections.abc import Sequence

import moderngl
import numpy as np

from replay.builtin import builtin_recording
from runtime.characters.open_character import load_character
from runtime.control.actions import press, set_value
from runtime.control.by_hand.pickable import Pickable
from runtime.driving.by_hand.choosing import Pair, Target
from runtime.render.picking import on_screen
from runtime.show.open_stream import play
from runtime.show.settings import MatchSettings, ShowSettings
from runtime.show.show import Show

SIZE = (960, 540)


class HandShow(Show):
    """A show without a window, and with the places that a user would click on."""

    def __init__(
        self,
        context: moderngl.Context,
        names: Sequence[str] = ("squid",),
        *,
        size: tuple[int, int] = SIZE,
        **match: object,
    ) -> None:
        super().__init__(
            play(builtin_recording("wave"), every_frame=True, loop=True),
            [load_character(name) for name in names],
            ShowSettings(size=size, match=MatchSettings(**match)),  # type: ignore[arg-type]  # of various types
            context=context,
        )
        self.chooser, self.scene = self.controls.chooser, self.controls.scene
        assert self.scene is not None
        self.perform(3)

    def perform(self, frames: int) -> np.ndarray:
        """Perform so many frames; the vertices of the first character."""
        for _ in range(frames):
            self.tick()
        return self.vertices[0].copy()

    def press(self, *names: str) -> None:
        for name in names:
            press(name, self.controls)

    def put(self, name: str, value: float) -> None:
        set_value(name, value, self.controls)

    @property
    def pickable(self) -> Pickable:
        return self.chooser._pickable

    def of_performer(self, name: str) -> tuple[float, float]:
        """The middle of a bone of the performer's part in the inset."""
        parts, joints = self.pickable.performer, self.scene.performer_on_screen
        line = joints[list(parts.chains[parts.named(name)])]
        x, y = (line[1] + line[2]) / 2.0 if len(line) > 2 else (line[0] + line[1]) / 2.0
        return float(x), float(y)

    def of_character(self, name: str, number: int = 0, share: float = 0.5) -> tuple[float, float]:
        """A place on the line of a part of a character."""
        chain = self.pickable.character(number).named(name)
        nodes = list(self.pickable.nodes(Target(number, chain)))
        points = self.puppets[number].places[nodes] + self.scene.position(number)
        places = on_screen(self.scene.seen_by, self.scene.stage.size, points)
        x, y = places[round(share * (len(places) - 1))]
        return float(x), float(y)

    def pair(self, source: str, target: str, number: int = 0) -> None:
        self.chooser.click(self.of_performer(source))
        self.chooser.click(self.of_character(target, number))

    @property
    def pairs(self) -> list[tuple[str, str]]:
        """The pairs that are chosen, in words."""
        assert self.chooser._choosing is not None
        return [self.words(pair) for pair in self.chooser._choosing.pairs]

    def words(self, pair: Pair) -> tuple[str, str]:
        target = self.pickable.name(pair.target).partition(" of")[0]
        return self.pickable.name(pair.source), target

    @property
    def driven(self) -> list[tuple[str, str]]:
        """What drives what now, in words."""
        match = self.controls.match_controls.matches[0]
        return [(part.name, part.target_name.partition(" of")[0]) for part in match.parts]

    @property
    def said(self) -> str:
        notice = self.controls.notices.latest
        return "" if notice is None else notice.text
