"""The driver that moves a body limb by limb: each points where the performer's points."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from devices.bodies.body_plan import SIDES
from devices.errors import InputError
from runtime.driving.body.bearing import Bearing, is_low, levelled, low_bearing, room_below
from runtime.driving.body.bent_legs import BentLegs
from runtime.driving.body.body_parts import TwoBodies, body_parts, two_bodies
from runtime.driving.body.footing import Footing, FootingState
from runtime.driving.body.forelegs import Forelegs
from runtime.driving.body.held_hands import HeldHands, are_held
from runtime.driving.body.joint_turns import JointTurns
from runtime.driving.body.long_arms import LongArms
from runtime.driving.body.many_legs import ManyLegs
from runtime.driving.body.path import Path
from runtime.driving.body.rearing import Rearing, pitched
from runtime.driving.body.serpent import Serpent, is_serpent
from runtime.driving.body.steady_trunk import SteadyTrunk, SteadyTrunkState
from runtime.driving.body.upright import upright_at_rest, upright_in_poses
from runtime.driving.body.wings import Wings
from runtime.driving.driver import Highlight, Needs
from runtime.driving.pairing import Pairing
from runtime.driving.performer import Pose, Rest
from runtime.driving.root_motion import chain_length
from runtime.driving.targets import PosedNodes, Targets
from solvers.retarget.heading import turned
from solvers.retarget.joint_rotations import RestTurn
from solvers.retarget.limb_posing import LimbPoser, LimbPoserState, point_hands
from solvers.retarget.steady_ends import SteadyEnds, SteadyEndsState
from solvers.skeleton.quaternions import rotate

Array = NDArray[np.float64]

_FORELEGS_REACH = np.array([1.0, 1.0, 0.0])  # pelvis and chest; the head looks where it looked
_MEASURED = 64  # poses of a clip in which the upright body is measured


@dataclass(frozen=True, slots=True, eq=False)
class BodyState:
    """The state of a `BodyDriver` between two frames.

    Attributes:
        rest: the performer's rest state; None while nothing drives.
        origin: (3,) [m] where the performer's hips were when the character began to travel.
        upright: (3, 4) the orientations of the performer's trunk while standing upright.
        trunk: of pelvis, chest and head.
        limbs: of all limbs.
        nodes: the posed nodes.
        rest_turn: what the performer's rotations mean.
        footing: of the feet.
        ends: of hands, feet and head.
    """

    rest: Rest | None
    origin: Array
    upright: Array
    trunk: SteadyTrunkState
    limbs: LimbPoserState
    nodes: PosedNodes
    rest_turn: RestTurn | None
    footing: FootingState
    ends: SteadyEndsState


class BodyDriver:
    """Moves the parts of a body as the same parts of the performer move.

    Legs and forelegs that bend at rest, as an animal's do, turn from there as the performer's turn
    from standing; all other limbs point where the performer's point.

    Args:
        pairing: the performer and the character.

    Attributes:
        parts: what drives what, in words and numbers.
        least_upright: cosine of the angle to the vertical beyond which a leg counts as bent.

    Raises:
        InputError: performer and character have no part in common.
    """

    needs = Needs()
    poses_nodes = True
    least_upright = float(np.cos(np.radians(35.0)))

    def __init__(self, pairing: Pairing) -> None:
        self._skeleton = skeleton = pairing.skeleton
        bodies, heading_at_rest = two_bodies(pairing)
        parts = body_parts(bodies, self.least_upright)
        if parts is None:
            raise InputError(f"{pairing.character.name} has no part that the performer has too")
        self.parts = parts.parts
        self._parts, self._facing = parts, bodies.facing
        feet = [limb.chain[-1] for limb in bodies.source.legs.values()]
        self._upright_at_rest = upright_at_rest(bodies.upright, bodies.facing, parts.trunk, feet)
        self._joint_turns = JointTurns(
            bodies.performer, (*parts.hands, parts.skull), heading_at_rest, bodies.facing
        )
        vertices, owner = pairing.surface.rest, skeleton.skin.nodes[:, 0]
        self._ratio = self._size_ratio(bodies.upright)
        self._bearing: Bearing | None = None
        self._many_legs: ManyLegs | None = None
        room, half = room_below(bodies, vertices, owner)
        if parts.steps or (parts.legs and is_low(bodies, room, half)):
            self._bearing = low_bearing(room, half)
        if parts.steps:
            self._many_legs = ManyLegs(bodies, parts.steps, room)
            self._ratio = self._many_legs.ratio
        self._serpent = Serpent(bodies) if is_serpent(bodies, vertices) else None
        if self._serpent is not None:
            self._ratio = self._serpent.reach / max(float(np.ptp(bodies.upright[:, 1])), 1e-9)
        # Who sits before a camera, or lends one arm only, does not move the whole.
        self._their_hips = _hips_that_lead(bodies)
        self._goes_along = len(parts.legs) == len(SIDES) or bool(self._their_hips)
        self._sinking = 1.0
        self._hips = [bodies.tree.root]
        if len(parts.legs) == len(SIDES):
            self._hips = [leg.target[0] for leg in parts.legs]
            self._their_hips = [leg.source[0] for leg in parts.legs]
            theirs = float(np.linalg.norm(np.diff(bodies.upright[self._their_hips], axis=0)))
            ours = float(np.linalg.norm(np.diff(bodies.tree.positions[self._hips], axis=0)))
            self._sinking = min(self._ratio * theirs / max(ours, 1e-9), 1.0)
        self._left = bodies.left
        self._footing = Footing(bodies, parts, vertices, owner)
        self._ends, self._bent_legs = _ends(bodies), BentLegs(bodies, parts.legs)
        self._held_hands = HeldHands(bodies) if are_held(bodies) else None
        self._rearing, self._wings = Rearing(bodies), Wings(bodies, parts.arms)
        self._forelegs = Forelegs(bodies, parts.arms, (vertices, skeleton.skin), self._ratio)
        self._long_arms = LongArms(bodies.tree, vertices, owner, parts.arms, parts.legs)
        self._at_rest = Targets(skeleton.skinned(skeleton.rest_nodes), nodes=skeleton.rest_nodes)
        self._rest: Rest | None = None
        self._origin: Array | None = None
        self._upright = self._upright_at_rest
        self._steady_trunk = SteadyTrunk(parts.trunk)
        self._limbs = LimbPoser(parts.rig)
        self._nodes = skeleton.rest_nodes

    def _size_ratio(self, upright: Array) -> float:
        """How long the character's legs are for each metre of the performer's."""
        nodes = self._skeleton.tree.positions
        theirs = ours = 0.0
        for leg in self._parts.legs:
            theirs += chain_length(upright, leg.source[:3])
            ours += chain_length(nodes, leg.target[:3])
        if theirs > 0.0:
            return ours / theirs
        return float(np.ptp(nodes[:, 1])) / max(float(np.ptp(upright[:, 1])), 1e-9)

    def prepare(self, clip: Sequence[Pose], rest: Rest | None) -> None:
        """Start to drive from this rest state: see `Driver.prepare`."""
        self._rest = rest
        self._origin = self._middle_of(clip[0]) if clip else None
        self.reset()
        self._upright = self._upright_at_rest
        known = self._joint_turns.learn(clip)
        if rest is not None and not known:
            step = max(len(clip) // _MEASURED, 1)
            shown = [pose.facing(self._facing) for pose in clip[::step]]
            own = turned(rest.positions, self._facing - rest.heading, np.zeros(3))
            self._upright = upright_in_poses(
                self._upright_at_rest, self._parts.trunk, shown or [own]
            )

    def targets(self, pose: Pose) -> Targets:
        """Return the targets for a pose; those of the rest pose while nothing drives."""
        rest, rig = self._rest, self._parts.rig
        if rest is None:
            return self._at_rest
        heading = pose.heading if self._goes_along else rest.heading
        joints = turned(pose.seen, self._facing - heading, pose.hips)
        self._ends.steady(joints, pose.time)
        self._limbs.begin(pose.time)
        if self._held_hands is not None:
            self._held_hands.reach_from_shoulders(joints)
        trunk = self._steady_trunk.turns(joints, self._upright, heading, pose.time)
        rotations, positions = np.empty((len(rig.order), 4)), np.empty((len(rig.order), 3))
        own = self._joint_turns.turns(pose, heading)
        given = self._given(own[:-1], joints)
        if own[-1].any():
            trunk[2] = own[-1]
        trunk[0] = levelled(trunk[0], self._sinking, self._left)
        self._footing.watch(pose)
        left = rotate(trunk[0], self._left)
        trunk = self._borne(trunk, joints, left)
        self._footing.turn_soles(joints, left, pose.time, given)
        self._wings.spread(joints, trunk[1], given)
        self._limbs.pose(joints, trunk, given, rotations, positions)
        if self._bent_legs.follow(joints, positions, rotations, left, given):
            self._limbs.pose(joints, trunk, given, rotations, positions)
        if self._many_legs is not None:
            self._many_legs.step(joints, positions, rotations, given)
            self._limbs.pose(joints, trunk, given, rotations, positions)
        if self._forelegs.follow(joints, self._footing.heights):
            trunk = self._on_forelegs((positions, rotations), joints, trunk, left, given)
        above = self._ratio * self._footing.above
        across = rotate(trunk[1], self._left)
        if self._long_arms.spread_wings(positions, rotations, given, across, above):
            self._limbs.pose(joints, trunk, given, rotations, positions)
        if self._long_arms.raise_arms(positions, rotations, given, across, above):
            self._limbs.pose(joints, trunk, given, rotations, positions)
        path = self._path(pose, rest, heading, positions)
        if self._many_legs is None:  # many feet stay where they stand as it is
            path, bends = self._planted(pose, path, (positions, rotations), left, given)
            if bends:
                self._limbs.pose(joints, trunk, given, rotations, positions)
        self._nodes = PosedNodes(positions, rotations)
        placement = path.placement(self._footing.clearance(pose))
        return Targets(self._skeleton.skinned(self._nodes), placement, self._nodes)

    def _borne(self, trunk: Array, joints: Array, left: Array) -> Array:
        """The turns (3, 4) of the character's trunk for those of the performer's.

        Args:
            trunk: (3, 4) of the performer's pelvis, chest and head.
            joints: (J, 3) [m] the performer, turned as the character faces.
            left: (3,) the body's left.
        """
        trunk = self._rearing.reared(trunk, joints, left)
        if self._serpent is not None:
            trunk = self._serpent.bearing(joints).of(trunk)
        return trunk if self._bearing is None else self._bearing.of(trunk)

    def _planted(
        self, pose: Pose, path: Path, nodes: tuple[Array, Array], left: Array, given: Array
    ) -> tuple[Path, bool]:
        """Keep feet planted: the path over them, and whether legs have to bend, as `given` says.

        Args:
            pose: of the performer.
            path: of the hips as the performer's.
            nodes: positions (K, 3) [m] and rotations (K, 4).
            left: (3,) the body's left.
            given: (S, 4) rotations of the segments; is changed.
        """
        if self._goes_along:
            to_stage = path.performer_on_stage, path.on_stage
            path = replace(path, shift=self._footing.hip_shift(pose, nodes[0], *to_stage))
        bends = self._footing.plant(
            pose,
            nodes,
            left,
            given,
            performer_on_stage=path.performer_on_stage,
            on_stage=path.on_stage,
            off_stage=path.off_stage,
        )
        return path, bends

    def _on_forelegs(
        self, nodes: tuple[Array, Array], joints: Array, trunk: Array, left: Array, given: Array
    ) -> Array:
        """Let forelegs stand; return the turns (3, 4) of the trunk, which sinks until they do.

        Args:
            nodes: positions (K, 3) [m] and rotations (K, 4); they are changed, as is `given`.
            joints: (J, 3) [m] the performer, turned as the character faces.
            trunk: (3, 4) as it would turn without them.
            left: (3,) the body's left.
            given: (S, 4) rotations of the segments.
        """
        positions, rotations = nodes
        sinks = self._forelegs.sinks(positions, rotations)
        if sinks != 0.0:
            trunk = pitched(trunk, -sinks * _FORELEGS_REACH, left)
            self._limbs.pose(joints, trunk, given, rotations, positions)
        for put in (self._forelegs.plant, self._forelegs.stand):
            put(positions, rotations, given)
            self._limbs.pose(joints, trunk, given, rotations, positions)
        return trunk

    def _given(self, hands: Array, joints: Array) -> Array:
        """The rotations (S, 4) of the hands, as the performer's rotations (S, 4) turn them.

        They point where the joints say, and the rotations decide how they are rolled.
        """
        rig, change = self._parts.rig, self._parts.hand_change
        given = np.zeros_like(hands)
        point_hands(hands, change, joints, rig.near, rig.far, rig.along, rig.across, given)
        return given

    def _middle_of(self, pose: Pose) -> Array:
        """The place (3,) [m] between the performer's hips; of the hips of who goes nowhere."""
        if not self._their_hips:
            return pose.hips
        middle: Array = pose.seen[self._their_hips].mean(axis=0)
        return middle

    def _path(self, pose: Pose, rest: Rest, heading: float, positions: Array) -> Path:
        """Where the whole is: the hips travel as the performer's, in lengths of the legs."""
        middle = self._middle_of(pose)
        if self._origin is None:
            self._origin = middle
        return Path(
            turn=heading - rest.heading,
            about=self._skeleton.tree.positions[self._skeleton.root],
            hips=self._parts.rig.rest[self._hips].mean(axis=0),
            posed=positions[self._hips].mean(axis=0),
            origin=self._origin * (1.0, 0.0, 1.0),
            course=self._facing - rest.heading,
            ratio=self._ratio if self._goes_along else 0.0,
            performer=middle,
            shift=np.zeros(2),
        )

    def reset(self) -> None:
        """Forget the poses before: see `Driver.reset`."""
        self._steady_trunk.reset()
        self._limbs.reset()
        self._nodes = self._skeleton.rest_nodes
        self._footing.reset()
        self._ends.reset()

    @property
    def highlights(self) -> list[Highlight]:
        """The driven parts; each lights up with the joints that drive it."""
        return [
            Highlight(self._nodes.positions[list(part.target)], part.source[1:])
            for part in self.parts
        ]

    def snapshot(self) -> BodyState:
        """Return what is remembered: see `Driver.snapshot`."""
        origin = np.full(3, np.nan) if self._origin is None else self._origin
        return BodyState(
            self._rest,
            origin,
            self._upright,
            self._steady_trunk.snapshot(),
            self._limbs.snapshot(),
            self._nodes,
            self._joint_turns.snapshot(),
            self._footing.snapshot(),
            self._ends.snapshot(),
        )

    def restore(self, state: BodyState) -> None:
        """Go back to a snapshot."""
        self._rest, self._nodes = state.rest, state.nodes
        self._steady_trunk.restore(state.trunk)
        self._origin = None if np.isnan(state.origin).any() else state.origin
        self._upright = state.upright
        self._limbs.restore(state.limbs)
        self._joint_turns.restore(state.rest_turn)
        self._footing.restore(state.footing)
        self._ends.restore(state.ends)


def _hips_that_lead(bodies: TwoBodies) -> list[int]:
    """The performer's hips, if both lead a body without pairs of limbs; it goes where they go."""
    legs, plan = bodies.source.legs, bodies.plan
    if (
        len(SIDES) in (len(plan.legs), len(plan.arms))
        or len(legs) < len(SIDES)
        or not bodies.trunk_drives
    ):
        return []
    return [legs[side].upper[0] for side in SIDES]


def _ends(bodies: TwoBodies) -> SteadyEnds:
    """The performer's hands, feet and head."""
    source = bodies.source
    limbs = [*source.arms.values(), *source.legs.values()]
    chains = [*(limb.end for limb in limbs), (*source.trunk[-1:], *source.head[1:])]
    ends = [chain for chain in chains if len(chain) > 1]
    return SteadyEnds([end[0] for end in ends], [end[-1] for end in ends])


class AbsoluteBodyDriver(BodyDriver):
    """A `BodyDriver` whose limbs all point where the performer's point, bent at rest or not."""

    least_upright = -np.inf
