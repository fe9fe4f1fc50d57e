"""Matches puppets to a performer: shows the best match of a pose, then lets it drive.

AniMesh section 3: the performer strikes a pose, the best match is shown at once and can be cycled
through, a comfortable pose becomes the rest state, and from there the motion is transferred.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from devices.skeleton import SkeletonFrame
from runtime.driving.choices import Choices
from runtime.driving.driver import DrivenPart
from runtime.driving.drivers import DriverFactory
from runtime.driving.mapping import Mapping
from runtime.driving.matching.puppet_match import PuppetMatch
from runtime.driving.matching.puppet_match_state import PuppetMatchState
from runtime.driving.performer import Performer, Pose, Rest, rest_state
from runtime.driving.polyline_driver import PolylineDriver
from runtime.driving.reach import Reach
from runtime.puppet.puppet import Puppet
from solvers.retarget.limb_shapes import most_different_poses
from solvers.retarget.source_limbs import simplify

LEAST_SEEN = 0.5  # share of the driving joints that must be in view to strike a pose
CHOICES = 32  # poses of a rehearsal, evenly spaced, that the rest state is chosen from
TRIED = 16  # poses of a rehearsal that the puppets try: those that differ most
BEGUN = 0.3  # [s] of keeping still, after which a countdown has begun
PLACED = 128  # poses of a rehearsal, evenly spaced, whose places on the stage are looked at

Array = NDArray[np.float64]
View = Callable[[], Array]


@dataclass(frozen=True, slots=True, eq=False)
class MatchSessionState:
    """The state of a `MatchSession` between two frames.

    Attributes:
        kept: (J, 3) [m] the pose that the performer keeps; None if no pose is struck.
        since: [s] since when it is kept and the same matches are shown.
        now: [s] time of the last frame.
        before: the performer's last pose.
        matches: of each puppet.
    """

    kept: Array | None
    since: float
    now: float
    before: Pose | None
    matches: tuple[PuppetMatchState, ...]


class MatchSession:
    """Matches puppets to the performer's pose until a match is accepted, then lets them perform.

    Puppets whose driver takes no mapping take part without a match: they perform from the same
    rest states.

    Args:
        performer: whose pose is matched.
        puppets: what follows the performer.
        view: gives the rotation (3, 3) from the stage to the camera, as it is now.
        choices: the settings of the matching.
        by_hand: for each puppet the mapping to use instead of a match, or None.
        make_driver: makes the driver of each puppet.

    Attributes:
        selected: the puppet that the actions on the matching are for; None for all.
        waits: whether what is shown waits to be accepted, however still the performer keeps.
    """

    def __init__(
        self,
        performer: Performer,
        puppets: Sequence[Puppet],
        view: View,
        choices: Choices,
        by_hand: Sequence[Mapping | None],
        *,
        make_driver: DriverFactory = PolylineDriver,
    ) -> None:
        self.selected: int | None = None
        self.waits = False
        self._performer = performer
        self._view = view
        self._stray = choices.stray
        source = simplify(performer.rest_tree())
        self._matches = [
            PuppetMatch(
                performer,
                source,
                puppet,
                choices=choices,
                by_hand=mapping,
                make_driver=make_driver,
            )
            for puppet, mapping in zip(puppets, by_hand, strict=True)
        ]
        self._kept: Array | None = None
        self._since = self._now = 0.0
        self._before: Pose | None = None

    def snapshot(self) -> MatchSessionState:
        """Return what is remembered between frames; puppets and performer have their own."""
        matches = tuple(match.snapshot() for match in self._matches)
        return MatchSessionState(self._kept, self._since, self._now, self._before, matches)

    def restore(self, state: MatchSessionState) -> None:
        """Go back to a snapshot."""
        self._kept, self._since, self._now = state.kept, state.since, state.now
        self._before = state.before
        for match, own in zip(self._matches, state.matches, strict=True):
            match.restore(own)

    @property
    def matching(self) -> bool:
        """Whether a match is looked for, for any puppet."""
        return any(match.matching for match in self._matches)

    @property
    def countdown(self) -> float | None:
        """[s] until what is shown performs by itself, if the performer keeps still.

        Infinite where it waits to be accepted; None while no pose is struck, or none is looked for.
        """
        sought = self._sought
        if not sought or self._kept is None or not all(match.can_perform for match in sought):
            return None
        patience = math.inf if self.waits else max(match.patience for match in sought)
        return max(patience - (self._now - self._since), 0.0)

    @property
    def counts(self) -> bool:
        """Whether the performer has kept still for so long that the countdown can be seen."""
        return self.countdown is not None and self._now - self._since >= BEGUN

    @property
    def matches(self) -> Sequence[PuppetMatch]:
        """The match of each puppet."""
        return self._matches

    @property
    def mappings(self) -> list[Mapping]:
        """For each puppet the mapping that drives it or is shown; without drives if none does."""
        return [match.mapping for match in self._matches]

    @property
    def parts(self) -> list[Sequence[DrivenPart]]:
        """For each puppet what drives what, in words and numbers."""
        return [match.parts for match in self._matches]

    @property
    def rests(self) -> list[Rest | None]:
        """For each puppet the performer's rest state; None while the puppet is not driven."""
        return [match.rest for match in self._matches]

    @property
    def needs_clip(self) -> bool:
        """Whether a driver needs the whole clip before the first frame."""
        return any(match.needs_clip for match in self._matches)

    def sees(self, frame: SkeletonFrame) -> bool:
        """Whether enough of the driving joints are in view to strike a pose."""
        return bool(np.mean(frame.confidence[self._performer.joints] > 0.0) >= LEAST_SEEN)

    def rehearse(self, poses: Sequence[Pose], clip: Sequence[Pose]) -> list[Reach]:
        """Let each puppet perform from the one of these poses that is most like it.

        A recorded performer cannot be asked to strike a pose, so the recording is looked through
        for one: its match is taken, and it is the rest state. The performer is seen facing the
        stage, whichever way the body had turned.

        Args:
            poses: at least one of those in which enough of the performer is in view.
            clip: every pose of the recording if `needs_clip`, else a selection.

        Returns:
            For each puppet the room that it takes in those poses.
        """
        view = self._view()
        evenly = _evenly(len(poses), CHOICES)
        states = [rest_state(poses[index], heading=0.0) for index in evenly]
        for match in self._matches:
            match.rehearse(clip, states, view)
        facing = np.array([pose.facing(0.0) - pose.hips for pose in poses])
        tried = [poses[index] for index in most_different_poses(facing, TRIED)]
        placed = [poses[index] for index in _evenly(len(poses), PLACED)]
        return [match.try_out(tried, placed) for match in self._matches]

    def direct(self, frame: SkeletonFrame) -> None:
        """While matching, show the best match of the newest pose; accept it after the countdown."""
        self._now = frame.time
        pose = self._performer.pose
        if pose is not None:
            self._turn_over(pose)
        sought = self._sought
        if not sought or pose is None:
            return
        if not self.sees(frame):
            self._kept = None  # a performer who comes back strikes a pose anew
            return
        view = self._view()
        changed = [match.match(pose.seen, frame.time, view) for match in sought]
        moved = any(match.needs_stillness for match in sought) and self._has_moved(pose.seen)
        if any(changed) or moved or self._kept is None or frame.time < self._since:
            self._kept, self._since = pose.seen, frame.time
        if self.countdown == 0.0:
            self.accept()

    def drive_with(self, make_driver: DriverFactory) -> None:
        """Switch the drivers of all puppets; each goes on from the same rest state.

        Raises:
            InputError: a new driver cannot drive its puppet, which goes on with the old one.
        """
        for match in self._matches:
            match.switch(make_driver, self._view())

    def accept(self) -> None:
        """Let what is shown perform from now on; the pose just struck is the rest state.

        Puppets that nothing is looked for go on as they perform.
        """
        self._perform(self._sought)

    def take_rest(self) -> None:
        """Take the pose just struck as the rest state, whether a match is looked for or not."""
        self._perform(self._chosen)

    def keep(self) -> None:
        """Stop looking for matches; puppets that performed before go on as they do."""
        for match in self._chosen:
            match.keep()

    def calibrate(self) -> None:
        """Take the pose just struck as the rest state, and measure floor and sizes anew."""
        self._performer.recalibrate()
        self.take_rest()

    def _turn_over(self, pose: Pose) -> None:
        """Adapt the rest states where left-right exchange or the scale was switched."""
        before, self._before = self._before, pose
        if before is None or (before.mirrored, before.scaled) == (pose.mirrored, pose.scaled):
            return
        mirror = before.mirrored != pose.mirrored
        ratio = pose.scale / before.scale if before.scaled != pose.scaled else 1.0
        for match in self._matches:
            if match.rest is not None:
                rest = self._performer.restated(match.rest, mirror=mirror, scale=ratio)
                match.restate(rest, self._view())

    def match_again(self) -> None:
        """Return to matching, by the pose alone, whatever was stepped to by hand.

        What performs goes on until what is shown is accepted; so it does while stepping.
        """
        self._kept = None
        for match in self._chosen:
            match.match_again(self._view())

    def choose(self, number: int, mapping: Mapping | None) -> None:
        """Let a puppet, by its number here, follow a mapping made by hand; None to match it again.

        Raises:
            InputError: the puppet cannot be driven so; nothing changes then.
        """
        self._kept = None
        if mapping is None:
            self._matches[number].match_again(self._view())
        else:
            self._matches[number].choose(mapping, self._view())

    def next_match(self) -> None:
        """Show the next match, and stay there; also while performing."""
        self._step(1)

    def previous_match(self) -> None:
        """Show the previous match, and stay there; also while performing."""
        self._step(-1)

    def show_match(self, rank: int) -> None:
        """Show one of the best matches, 1 for the first, and stay there; as `next_match`."""
        self._kept = None
        for match in self._chosen:
            match.take(rank, self._view())

    @property
    def _chosen(self) -> list[PuppetMatch]:
        """The puppets that actions are for."""
        return self._matches if self.selected is None else [self._matches[self.selected]]

    @property
    def _sought(self) -> list[PuppetMatch]:
        """The puppets that a match is looked for."""
        return [match for match in self._matches if match.matching]

    def _step(self, ranks: int) -> None:
        self._kept = None
        for match in self._chosen:
            match.step(ranks, self._view())

    def _perform(self, matches: Sequence[PuppetMatch]) -> None:
        pose = self._performer.pose
        if pose is None or not all(match.can_perform for match in matches):
            return
        rest = rest_state(pose)
        for match in matches:
            match.perform(rest, self._view())

    def _has_moved(self, positions: Array) -> bool:
        """Whether a driving joint is far from where it was when the pose was struck."""
        if self._kept is None or self._stray == np.inf:
            return False
        joints = self._performer.joints
        kept, now = self._kept[joints], positions[joints]
        size = float(np.ptp(kept, axis=0).max())
        return bool(np.linalg.norm(now - kept, axis=1).max() > self._stray * size)


def _evenly(count: int, most: int) -> list[int]:
    """Return up to `most` of `count` indices, evenly spaced, the first and the last among them."""
    indices: list[int] = np.unique(np.linspace(0, count - 1, most).round().astype(int)).tolist()
    return indices
