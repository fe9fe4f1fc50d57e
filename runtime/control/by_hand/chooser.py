"""Mapping by hand: clicks on the performer's small picture and on characters become pairs.

AniMesh (Jin et al. 2015), section 3 and figure 2: the user overrides the matching by selecting
chains of the source and of the target.
"""

from __future__ import annotations

from collections.abc import Sequence

from devices.errors import InputError
from devices.skeleton import Skeleton
from runtime.control.by_hand.chain_lights import ChainLights
from runtime.control.by_hand.pickable import Part, Pickable, Place
from runtime.driving.by_hand.choosing import (
    Choosing,
    Target,
    mapping_of,
    pairs_of,
    phase_of,
)
from runtime.driving.driver import RELATIVE, DrivenPart
from runtime.driving.matching.puppet_match import PuppetMatch
from runtime.puppet.puppet import Puppet
from runtime.show.act_group import ActGroup
from runtime.show.scene import Scene
from runtime.status.choosing_words import ChoosingStatus
from runtime.status.notices import Notices

WIDER = 0.85  # of what the widest view shows: one that shows less is worth a word


class Chooser:
    """Lets a user choose pairs by hand, and lights up what can be clicked.

    Args:
        acts: what follows which performer.
        puppets: all characters, from left to right.
        performer: the skeleton of all performers.
        scene: the picture; None where there is none, and nothing can be chosen.
        notices: told what was done.
        recorded: whether the performer is a recording.

    Attributes:
        together: whether a click on a chain of a character takes all that repeat it.
    """

    def __init__(
        self,
        acts: ActGroup,
        puppets: Sequence[Puppet],
        performer: Skeleton,
        scene: Scene | None,
        notices: Notices,
        *,
        recorded: bool,
    ) -> None:
        self.together = False
        self._acts, self._puppets, self._scene = acts, puppets, scene
        self._notices, self._recorded = notices, recorded
        self._choosing: Choosing | None = None
        self._began = Choosing()
        self._phase = self._phase_at_first = 0.0
        self._at: Place | None = None
        if scene is not None:
            self._pickable = Pickable(scene, puppets, performer)
            self._lights = ChainLights(self._pickable, puppets)

    @property
    def on(self) -> bool:
        """Whether pairs are being chosen."""
        return self._choosing is not None

    def begin(self) -> None:
        """Begin to choose, from the pairs that drive now."""
        scene = self._scene
        if scene is None or scene.inset_side == 0.0:
            self._notices.show("no small picture of the performer is shown to click on")
            return
        pairs = [
            pair
            for number, match in enumerate(self._acts.matches)
            for pair in pairs_of(
                match.parts, number, self._pickable.performer, self._pickable.character(number)
            )
        ]
        self._phase = self._phase_at_first = self.phase
        self._choosing = self._began = Choosing(tuple(pairs))
        self._acts.wait(True)
        scene.lights = self._lights
        self.look()

    def leave(self) -> None:
        """Stop choosing; what drives goes on as it does."""
        self._choosing = None
        self._acts.wait(False)
        if self._scene is not None:
            self._scene.lights = None

    def accept(self) -> None:
        """Let the pairs drive from now on, if they have changed."""
        choosing, done = self._choosing, []
        if choosing is None:
            return
        for number, puppet in enumerate(self._puppets):
            pairs, name = choosing.of(number), puppet.character.name
            if not self._is_changed(number):
                continue
            parts, mapping = self._pickable.character(number), None
            if pairs:
                performer, bound = self._pickable.performer, puppet.bound_skeleton
                mapping = mapping_of(pairs, performer, parts, bound, self._phase)
            try:
                self._acts.choose(number, mapping)
            except InputError as error:
                self._notices.show(str(error), fault=True)
                return
            many = "1 pair" if len(pairs) == 1 else f"{len(pairs)} pairs"
            done.append(f"{name} follows {many} by hand" if pairs else f"{name} is matched again")
        self.leave()
        self._notices.show("; ".join(done) or "nothing was changed")

    def clear(self) -> None:
        """Remove all pairs of the selected character, or of all characters."""
        choosing, selected = self._choosing, self._acts.selected
        if choosing is None:
            return
        for number in range(len(self._puppets)):
            if selected in (None, number):
                choosing = choosing.cleared(number)
        self._choosing = choosing
        self.look()

    @property
    def phase(self) -> float:
        """[s] how much later each chain of a group follows than the one before."""
        if self.on:
            return self._phase
        return max((phase_of(match.setup.mapping) for match in self._selected), default=0.0)

    @phase.setter
    def phase(self, seconds: float) -> None:
        self._phase = seconds
        if not self.on:
            for match in self._selected:
                match.delay(seconds)

    def point(self, at: Place) -> None:
        """Point at a place of the picture; `look` tells what lies there."""
        self._at = at

    def look(self) -> None:
        """Light up what lies at the place that is pointed at, where everything is now."""
        choosing = self._choosing
        if choosing is None:
            return
        under = None if self._at is None else self._pickable.under(self._at)
        bright: set[Part] = set(choosing.targets)
        if choosing.source is not None:
            bright.add(choosing.source)
        pointed = self._taken_with(under) if isinstance(under, Target) else (under,)
        bright.update(part for part in pointed if part is not None)
        for pair in choosing.pairs:  # on the other side, too
            if under in (pair.source, pair.target):
                bright.update((pair.source, pair.target))
        self._lights.pairs, self._lights.bright = choosing.pairs, frozenset(bright)

    def click(self, at: Place) -> None:
        """Click on a place of the picture."""
        choosing = self._choosing
        if choosing is None:
            return
        self._at, under = at, self._pickable.under(at)
        if isinstance(under, Target):
            self._choosing = choosing.click_character(self._taken_with(under))
        elif under is not None:
            self._choosing = choosing.click_performer(under)
        self.look()

    @property
    def status(self) -> ChoosingStatus | None:
        """The progress of mapping by hand; None while it is off."""
        choosing, scene = self._choosing, self._scene
        if choosing is None or scene is None:
            return None
        first = Target(self._acts.selected or 0, -1)
        target = ""
        if choosing.targets:
            first = choosing.targets[0]
            target = self._pickable.name(first)
            more = len(choosing.targets) - 1
            target += f" and {more} like it" if more else ""
        return ChoosingStatus(
            character=self._puppets[first.character].character.name,
            recorded=self._recorded,
            source="" if choosing.source is None else self._pickable.name(choosing.source),
            target=target,
            pairs=len(choosing.pairs),
            changed=any(map(self._is_changed, range(len(self._puppets)))),
            wider=scene.shown_share(self._acts.selected) < WIDER,
        )

    def chosen(self, number: int) -> list[DrivenPart]:
        """Return the pairs of a character in words."""
        if self._choosing is None:
            return []
        performer, parts = self._pickable.performer, self._pickable.character(number)
        return [
            DrivenPart(
                performer.names[pair.source],
                parts.names[pair.target.chain],
                performer.chains[pair.source],
                parts.chains[pair.target.chain],
                RELATIVE,
            )
            for pair in self._choosing.of(number)
        ]

    @property
    def _selected(self) -> list[PuppetMatch]:
        matches, selected = self._acts.matches, self._acts.selected
        return matches if selected is None else [matches[selected]]

    def _taken_with(self, target: Target) -> tuple[Target, ...]:
        """A chain of a character, with all that are taken with it."""
        if not self.together:
            return (target,)
        alike = self._pickable.character(target.character).alike(target.chain)
        return tuple(Target(target.character, chain) for chain in alike)

    def _is_changed(self, number: int) -> bool:
        """Whether a character has other pairs than those that drive it, or another phase."""
        if self._choosing is None:
            return False
        pairs = self._choosing.of(number)
        spread = len({pair.source for pair in pairs}) < len(pairs)
        return pairs != self._began.of(number) or (spread and self._phase != self._phase_at_first)
