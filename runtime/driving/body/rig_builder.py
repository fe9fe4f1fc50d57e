"""Builds the rig of a character's body: which limb segment follows which of the performer's."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from devices.bodies.body_plan import BodyPlan, Chain, Limb
from devices.bodies.joint_names import Side
from runtime.driving.driver import ABSOLUTE, RELATIVE
from solvers.retarget.limb_posing import BLENDS, RIDES, LimbRig, hand_frame
from solvers.skeleton.quaternions import conjugate, multiply
from solvers.skeleton.tree import Tree

Array = NDArray[np.float64]

_DOWN = np.array([0.0, -1.0, 0.0])
LOW = 0.15  # of the height: a limb that ends lower stands on the floor
_STANDS = 0.5  # cosine of the angle to the vertical beyond which a leg from hip to ankle lies
_BESIDE = 0.35  # of the forearm: bones that begin this near to the wrist are parts of the hand


class RigBuilder:
    """Collects the segments of a `LimbRig`."""

    def __init__(self, tree: Tree, upright: Array, facing: float) -> None:
        self._tree, self._rest, self._upright = tree, tree.positions, upright
        self._front = np.array([np.sin(facing), 0.0, np.cos(facing)])
        self._role = np.full(len(tree), RIDES)
        self._share = np.zeros(len(tree))
        self._near: list[int] = []
        self._far: list[int] = []
        self._across: list[tuple[int, int]] = []
        self._along: list[Array] = []
        self._frame: list[Array] = []
        self._is_free: list[bool] = []
        self._twisted_by: list[int] = []
        self.hands: list[int] = []
        self.hand_change: list[Array] = []

    def drive_of(self, limbs: Iterable[Limb], least_upright: float) -> str:
        """How a pair of limbs is driven: relative if it stands on the floor, and bends at rest.

        Legs that lie on the floor, as of a toy that sits, do not stand, nor do those of an animal
        that leaps: they point.

        Args:
            limbs: the pair.
            least_upright: cosine of the angle to the vertical beyond which a segment leans.
        """
        pair = list(limbs)
        low = self._rest[:, 1].min() + LOW * np.ptp(self._rest[:, 1])
        wholes = [(limb.upper[0], (limb.lower or limb.upper)[-1]) for limb in pair]
        upright = [float(_direction(self._rest, whole) @ _DOWN) for whole in wholes]
        for limb, own in zip(pair, upright, strict=True):
            both = min(own, float(np.mean(upright))) > _STANDS
            stands = both and self._rest[limb.segments[-1][-1], 1] < low
            leans = any(
                _direction(self._rest, chain) @ _DOWN < least_upright
                for chain in (limb.upper, limb.lower)
                if chain
            )
            if stands and leans:
                return RELATIVE
        return ABSOLUTE

    def add_leg(self, theirs: Limb, ours: Limb, drive: str) -> tuple[int, int, int]:
        """Let a leg follow a leg; return its segments as of `Leg`."""
        last, foot = self._follow(theirs, ours, drive, self._upright), -1
        ends = theirs.end or (theirs.lower or theirs.upper)[-1:]
        if ours.end:
            foot = self._add(ours.end, ends[0], ends[-1])
        elif ours.lower:  # a foot of one joint is a foot too
            ankle = ours.lower[-1]
            foot = self._add((ankle, ankle), ends[0], ends[-1])
        if foot >= 0:
            self._is_free[foot] = True
            self._along[foot] = _direction(self._upright, ends)
        return last - 1, last, foot

    def add_step(self, theirs: Limb, ours: Limb) -> tuple[int, int]:
        """Let both segments of a leg of many be turned by its step; return their numbers."""
        near, far = theirs.upper[0], (theirs.lower or theirs.upper)[-1]
        return self._add(ours.upper, near, far), self._add(ours.lower, near, far)

    def add_arm(
        self,
        theirs: Limb,
        ours: Limb,
        source_knuckles: tuple[int, int] | None,
        target_knuckles: tuple[int, int] | None,
        drive: str,
    ) -> tuple[int, ...]:
        """Let an arm follow an arm, its hand a hand; return the numbers of its segments.

        A foreleg turns from where it stands as an arm turns from hanging down.
        """
        first = len(self._near)
        last = self._follow(theirs, ours, drive, None)
        if ours.end and theirs.end:
            hand = self._add_hand(theirs, ours, source_knuckles, target_knuckles)
            if ours.lower:
                self._twisted_by[last] = hand
                self._take_beside(ours, hand)
        elif ours.end and ours.lower:  # it goes along, but may give way to the floor
            wrist = (theirs.lower or theirs.upper)[-1]
            self._take_beside(ours, self._add(ours.end, wrist, wrist))
        return tuple(range(first, len(self._near)))

    def add_wing(self, theirs: Limb, ours: Limb) -> tuple[int, ...]:
        """Let each bone of a wing turn on its own with an arm; return the numbers of its segments.

        See `Wings`, which says how they turn.
        """
        first, lower = len(self._near), theirs.lower or theirs.upper
        inner = len(ours.upper) - 1
        for bone in range(len(ours.chain) - 1):
            source = theirs.upper if bone < inner else lower
            self._add(ours.chain[bone : bone + 2], source[0], source[-1])
        return tuple(range(first, len(self._near)))

    def _add_hand(
        self,
        theirs: Limb,
        ours: Limb,
        source_knuckles: tuple[int, int] | None,
        target_knuckles: tuple[int, int] | None,
    ) -> int:
        """Let a hand follow by its knuckles, else by the wrist's rotation; return its number."""
        hand = self._add(ours.end, theirs.end[0], theirs.end[-1])
        frame = self._hand_at_rest(self._rest, ours.end, target_knuckles)
        if source_knuckles:
            self._across[hand], self._frame[hand] = source_knuckles, frame
        else:
            self.hands[hand] = theirs.end[0]
            theirs_at_rest = self._hand_at_rest(self._upright, theirs.end, None)
            self.hand_change[hand] = multiply(theirs_at_rest, conjugate(frame))
        return hand

    def _hand_at_rest(self, points: Array, hand: Chain, knuckles: tuple[int, int] | None) -> Array:
        """The orientation (4,) of a hand at rest; without knuckles its palm looks down or inward.

        The index finger is then in front, as in a T pose and beside the thighs alike.
        """
        if knuckles is not None:
            return hand_frame(points, hand[0], hand[-1], knuckles)
        behind = points[hand[0]] - self._front
        three = np.array([points[hand[0]], points[hand[-1]], behind])
        return hand_frame(three, 0, 1, (0, 2))

    def add_fingers(self, source: BodyPlan, plan: BodyPlan, side: Side) -> None:
        """Let each finger follow the finger of the same name, bone for bone."""
        for key, ours in plan.fingers.items():
            theirs = source.fingers.get(key)
            if key[0] is not side or theirs is None:
                continue
            bones = min(len(ours), len(theirs)) - 1
            for bone in range(bones):
                last = len(theirs) - 1 if bone == bones - 1 else bone + 1
                self._add(ours[bone : bone + 2], theirs[bone], theirs[last])

    def blend_trunk(self, plan: BodyPlan, has_head: bool) -> None:
        """Bend the trunk between pelvis and chest, and the neck between chest and head."""
        self._blend(plan.trunk, 0.0)
        if len(plan.trunk) == 1:
            self._share[plan.hips] = 0.5
        if has_head and plan.skull is not None:
            neck = plan.head[: plan.head.index(plan.skull) + 1]
            self._blend(neck, 1.0, skip=1 if len(plan.trunk) > 1 or len(neck) > 1 else 0)
            for node in plan.head[len(neck) :]:
                self._role[node] = RIDES

    def finished(self) -> LimbRig:
        """The rig."""
        return LimbRig(
            order=np.array(self._tree.order, dtype=np.int64),
            parents=self._tree.parents,
            rest=self._rest,
            role=self._role.astype(np.int64),
            share=self._share,
            near=np.array(self._near, dtype=np.int64),
            far=np.array(self._far, dtype=np.int64),
            across=np.array(self._across, dtype=np.int64).reshape(-1, 2),
            along=np.array(self._along).reshape(-1, 3),
            frame=np.array(self._frame).reshape(-1, 4),
            is_free=np.array(self._is_free, dtype=np.bool_),
            twisted_by=np.array(self._twisted_by, dtype=np.int64),
        )

    def _follow(self, theirs: Limb, ours: Limb, drive: str, neutral: Array | None) -> int:
        """Let upper and lower segment follow; return the number of the last one."""
        pairs = [(ours.upper, theirs.upper)]
        if not ours.lower and theirs.lower:
            pairs = [(ours.upper, theirs.upper + theirs.lower)]
        elif ours.lower:
            pairs.append((ours.lower, theirs.lower or theirs.upper))
        for mine, source in pairs:
            last = self._add(mine, source[0], source[-1])
            if drive == RELATIVE:
                self._along[last] = _DOWN if neutral is None else _direction(neutral, source)
        return last

    def _add(self, nodes: Chain, near: int, far: int) -> int:
        """Let the bones of a segment follow the line between two joints; return its number."""
        number = len(self._near)
        free = [node for node in nodes[:-1] if self._role[node] == RIDES]
        self._role[free] = number
        self._near.append(near)
        self._far.append(far)
        self._across.append((-1, -1))
        self._along.append(_direction(self._rest, nodes))
        self._frame.append(np.zeros(4))
        self._is_free.append(False)
        self._twisted_by.append(-1)
        self.hands.append(-1)
        self.hand_change.append(np.zeros(4))
        return number

    def _take_beside(self, ours: Limb, hand: int) -> None:
        """Let all bones turn with the hand that begin beside its wrist on the forearm."""
        wrist = ours.end[0]
        reach = _BESIDE * float(np.linalg.norm(self._rest[wrist] - self._rest[ours.lower[0]]))
        for node in self._tree.children[int(self._tree.parents[wrist])]:
            near = float(np.linalg.norm(self._rest[node] - self._rest[wrist])) < reach
            if near and node not in ours.lower and self._role[node] == RIDES:
                self._role[node] = hand

    def _blend(self, chain: Chain, start: float, skip: int = 0) -> None:
        lengths = np.linalg.norm(np.diff(self._rest[list(chain)], axis=0), axis=1)
        along = np.append(0.0, lengths.cumsum())
        shares = along / along[-1] if along[-1] > 0.0 else np.linspace(0.0, 1.0, len(chain))
        for node, share in list(zip(chain, shares, strict=True))[skip:]:
            self._role[node], self._share[node] = BLENDS, start + share


def _direction(points: Array, chain: Chain) -> Array:
    """The unit vector (3,) from the first to the last of some points; down without length."""
    gap = points[chain[-1]] - points[chain[0]]
    length = float(np.linalg.norm(gap))
    return gap / length if length > 0.0 else _DOWN
