"""Choosing what drives what: the mapping given by hand, or that of a ranked match of a pose."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from devices.errors import InputError
from runtime.driving.choices import Choices
from runtime.driving.mapping import Drive, Mapping
from runtime.driving.matching.match_guard import MatchGuard
from runtime.driving.performer import Performer, Rest
from runtime.driving.polyline_driver import STRAIGHT_ON
from runtime.puppet.puppet import Puppet
from solvers.matching import SIZE_PREFERENCE, Match, TargetHierarchy
from solvers.retarget.limb_shapes import shape_likeness
from solvers.retarget.match_hysteresis import MatchHysteresis
from solvers.retarget.source_limbs import SimplifiedSource

CANDIDATES = 20  # matches that can be cycled through
_MIRRORED = np.diag([-1.0, 1.0, 1.0])

Array = NDArray[np.float64]


class MappingChoice:
    """Chooses mappings of one performer to one puppet.

    Args:
        performer: the performer whose poses are matched.
        source: the performer's chosen joints at rest, simplified.
        puppet: what is driven.
        choices: the settings of the matching.
        by_hand: the mapping to use instead of a match, or None.

    Attributes:
        by_hand: as given; may be set.
    """

    def __init__(
        self,
        performer: Performer,
        source: SimplifiedSource,
        puppet: Puppet,
        choices: Choices,
        by_hand: Mapping | None,
    ) -> None:
        self._performer, self._source, self._puppet = performer, source, puppet
        self._choices, self.by_hand = choices, by_hand
        self._hierarchy = TargetHierarchy(puppet.bound_skeleton.tree, puppet.bound_skeleton.root)
        self._hierarchy.rank(source, STRAIGHT_ON, limit=1)  # so that no frame waits for a compiler

    def of_pose(
        self,
        hysteresis: MatchHysteresis,
        positions: Array,
        time: float,
        view: Array,
        guard: MatchGuard | None = None,
    ) -> Mapping:
        """Return the mapping for a pose.

        Args:
            hysteresis: chooses among the ranked matches, and remembers which it shows.
            positions: (J, 3) [m] the performer's joints.
            time: [s].
            view: (3, 3) rotation from the stage to the camera.
            guard: ranks the matches by anatomy too; None for the screen alone.

        Raises:
            InputError: there is no match of the rank that was chosen.
        """
        if self.by_hand is not None:
            return self.by_hand
        pose, wanted = positions[self._performer.joints], CANDIDATES + self._choices.rank
        ranked = guard.rank(pose, view, wanted) if guard is not None else []
        if not ranked:
            ranked = self._hierarchy.rank(
                self._source, view, pose, limit=wanted, size_preference=SIZE_PREFERENCE
            )
        match = hysteresis.update(ranked, time)
        if len(ranked) < self._choices.rank or match is None:
            raise InputError(
                f"{self._puppet.character.name} has {len(ranked)} matches with this part "
                f"of the performer, so there is no --match {self._choices.rank}"
            )
        return self.mapping_of(match)

    def best_of(
        self,
        states: Sequence[Rest],
        view: Array,
        of_anatomy: Mapping | None = None,
        guard: MatchGuard | None = None,
    ) -> tuple[Mapping, Rest, MatchHysteresis]:
        """Return the rest state that is most like the puppet, its mapping and its hysteresis.

        Args:
            states: at least one.
            view: (3, 3) rotation from the stage to the camera.
            of_anatomy: a mapping in place of matches; a limb may then point to the other side of
                the screen, as one that is driven by the performer's limb of the other side does.
            guard: as of `of_pose`.

        Raises:
            InputError: there is no match of the rank that was chosen.
        """
        choices = []
        for state in states:  # each by itself: no state waits for the one before
            hysteresis = MatchHysteresis(self._choices.rank - 1)
            mapping = of_anatomy or self.of_pose(hysteresis, state.positions, 0.0, view, guard)
            choices.append((mapping, state, hysteresis))
        seen = (STRAIGHT_ON,) if of_anatomy is None else (STRAIGHT_ON, _MIRRORED)
        worths = [self._worth(mapping, state, view, seen) for mapping, state, _ in choices]
        return choices[int(np.argmax(worths))]

    def mapping_of(self, match: Match) -> Mapping:
        """Return the mapping of a match: its chains without the parts inside the trunk."""
        chosen = match if self._choices.extend else match.stopped()
        joints, skeleton = self._performer.joints, self._puppet.bound_skeleton
        drives = []
        for pair, (nodes, matched) in enumerate(chosen.pairs):
            source = tuple(joints[node] for node in nodes)
            target = skeleton.limb(matched) if pair < match.limbs else matched
            if len(target) < len(matched):
                source = self._performer.limb(source)
            if len(source) > 1 and len(target) > 1:
                drives.append(Drive(source, target, self._choices.flip))
        return Mapping(tuple(drives), match.score)

    def _worth(self, mapping: Mapping, rest: Rest, view: Array, seen: Sequence[Array]) -> float:
        """How well a rest state suits: the match's score plus the likeness of the limbs' shapes.

        Of several views of the performer each limb takes the one in which it is most alike.
        """
        nodes = self._puppet.bound_skeleton.tree.positions
        shapes = sum(
            max(
                shape_likeness(
                    rest.positions[list(drive.source)], nodes[list(drive.target)], own, view
                )
                for own in seen
            )
            for drive in mapping.drives
        )
        return shapes + (mapping.score if np.isfinite(mapping.score) else 0.0)
