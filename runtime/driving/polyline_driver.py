"""The driver that transfers motion from chains of the performer to chains of the character.

AniMesh (Jin et al. 2015), section 5: each chain turns from the rest pose of the character as the
performer's chain turns from the performer's rest state.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from devices.bodies.plan_by_names import plan_by_names
from devices.errors import InputError
from runtime.driving.driven_chains import DrivenChains
from runtime.driving.driver import (
    RELATIVE,
    DrivenPart,
    Highlight,
    MappedDriver,
    Needs,
    StretchLimits,
)
from runtime.driving.exaggeration import Exaggeration, ExaggerationState, Strain
from runtime.driving.limb_release import LimbRelease, LimbReleaseState
from runtime.driving.mapping import Mapping
from runtime.driving.pairing import Pairing
from runtime.driving.part_names import part_name
from runtime.driving.performer import Pose, Rest
from runtime.driving.root_motion import RootMotion, chain_length, legs_of, root_motion
from runtime.driving.targets import HandleTargets, PosedNodes, SkinnedTargets, Targets
from runtime.puppet.bound_skeleton import Anchors
from solvers.retarget.chain_retargets import ChainRetargets, ChainRetargetsState
from solvers.retarget.polyline_motion import map_chain
from solvers.signal.delay_line import DelayLine, DelayLineState

Array = NDArray[np.float64]

STRAIGHT_ON = np.eye(3)  # the view of a capture device


@dataclass(frozen=True, slots=True, eq=False)
class LinkState:
    """What drives, and what its parts remember between frames: see `_Link`."""

    mapping: Mapping
    view: Array
    rest: Rest
    retargets: ChainRetargetsState
    exaggeration: ExaggerationState
    limb_release: LimbReleaseState
    delays: DelayLineState


@dataclass(frozen=True, slots=True, eq=False)
class PolylineState:
    """The state of a `PolylineDriver` between two frames.

    Attributes:
        mapping: the mapping that is shown.
        view: (3, 3) of the stage when it was shown.
        gains: (D,) of the drives.
        positions: (K, 3) [m] the nodes, for the highlights.
        weights: (A,) how firmly each anchor is held.
        link: what drives; None if nothing does.
    """

    mapping: Mapping
    view: Array
    gains: Array
    positions: Array
    weights: Array
    link: LinkState | None


@dataclass(frozen=True, slots=True, eq=False)
class _Link:
    """A mapping from one rest state on, and what its parts remember between frames.

    Attributes:
        mapping: what drives.
        view: (3, 3) rotation from the stage to the camera when the driving began.
        rest: the performer's rest state.
        chains: the driven chains of the character.
        source_tips: (D,) last joint of each of the performer's chains.
        root_motion: how far the whole character goes along.
        retargets, exaggeration, limb_release, delays: these remember the frames before.
    """

    mapping: Mapping
    view: Array
    rest: Rest
    chains: DrivenChains
    source_tips: NDArray[np.int64]
    root_motion: RootMotion
    retargets: ChainRetargets
    exaggeration: Exaggeration
    limb_release: LimbRelease
    delays: DelayLine

    def reset(self) -> None:
        self.retargets.reset()
        self.delays.reset()
        self.exaggeration.reset()
        self.limb_release.reset()

    def snapshot(self) -> LinkState:
        return LinkState(
            self.mapping,
            self.view,
            self.rest,
            self.retargets.snapshot(),
            self.exaggeration.snapshot(),
            self.limb_release.snapshot(),
            self.delays.snapshot(),
        )

    def restore(self, state: LinkState) -> None:
        self.retargets.restore(state.retargets)
        self.exaggeration.restore(state.exaggeration)
        self.limb_release.restore(state.limb_release)
        self.delays.restore(state.delays)


class PolylineDriver(MappedDriver):
    """Moves chains of a character relative to a rest state, as chains of the performer move.

    Args:
        pairing: the performer and the character.

    Attributes:
        mapping: the mapping that drives, or that is shown.
        gains: (D,) for each drive the share of the performer's turns that is carried over, in
            (0, 1].
    """

    needs = Needs()
    poses_nodes = True
    limits = StretchLimits()

    def __init__(self, pairing: Pairing) -> None:
        self.mapping = Mapping(())
        self.gains = np.ones(0)
        self._view = STRAIGHT_ON
        self._performer = pairing.performer
        self._performer_plan = plan_by_names(pairing.performer)
        self._legs = legs_of(pairing.performer)
        self._character = pairing.character
        self._skeleton = pairing.skeleton
        self._surface = pairing.surface
        self._link: _Link | None = None
        self._positions = pairing.skeleton.tree.positions
        self._weights = pairing.skeleton.rest_targets.weights

    def show(self, mapping: Mapping, view: Array) -> None:
        """Show a mapping without being driven by it: see `MappedDriver.show`."""
        self.mapping, self._view = mapping, view

    def prepare(self, clip: Sequence[Pose], rest: Rest | None) -> None:
        """Start to drive by the mapping shown, from this rest state: see `Driver.prepare`.

        Raises:
            InputError: chains that share a bone, or lead towards one another.
        """
        if rest is None:
            self._link = None
            self._positions = self._skeleton.tree.positions
            self._weights = self._skeleton.rest_targets.weights
            return
        drives, nodes = self.mapping.drives, self._skeleton.tree.positions
        chains = self._driven_chains()
        maps = [
            map_chain(
                rest.positions[list(drive.source)],
                nodes[list(drive.target)],
                STRAIGHT_ON,
                self._view,
                drive.flip,
            )
            for drive in drives
        ]
        lengths = np.array([chain_length(nodes, drive.target) for drive in drives])
        height = float(np.ptp(self._character.vertices[:, 1]))
        self._link = _Link(
            mapping=self.mapping,
            view=self._view,
            rest=rest,
            chains=chains,
            source_tips=np.array([drive.source[-1] for drive in drives], dtype=np.int64),
            root_motion=root_motion(self.mapping, self._legs, rest.positions, nodes),
            retargets=ChainRetargets(maps, [drive.source for drive in drives]),
            exaggeration=Exaggeration(lengths, height),
            limb_release=LimbRelease(len(drives)),
            delays=DelayLine(_delays(self.mapping)),
        )
        self.gains = np.ones(len(drives))
        self._weights = chains.weights(self._link.limb_release.weights)

    def _driven_chains(self) -> DrivenChains:
        """The chains of the mapping, around a root that all of them lead away from."""
        skeleton = self._skeleton
        chains = tuple(drive.target for drive in self.mapping.drives)
        # Where any node will do, the nearest start of a chain does too, and moves it alike: no
        # driven bone lies between them.
        for root in dict.fromkeys((skeleton.root, *(chain[0] for chain in chains))):
            try:
                return DrivenChains(skeleton, root, chains)
            except ValueError as error:
                refusal = error
        raise InputError(
            f"{self._character.name} cannot be driven so: {refusal}; let all polylines lead "
            f"away from one node, as from {skeleton.root}, and none share a bone"
        ) from refusal

    def targets(self, pose: Pose) -> Targets:
        """Return the targets for a pose; those of the rest pose while nothing drives."""
        link = self._link
        if link is None:
            return self._skeleton.at_rest
        chains = link.chains
        turns = link.retargets.rotations(pose.facing(link.rest.heading), self.gains)
        if self._spread:
            turns = link.delays.follow(pose.time, turns)
        placed = chains.place(turns)
        placement = link.root_motion.placement(pose, link.rest)
        if link.limb_release.follow(pose.time, ~pose.filled[link.source_tips]):
            self._weights = chains.weights(link.limb_release.weights)
        elasticity, posed = self._surface.elasticity, placed.positions
        tips = posed[chains.tips] - posed[chains.starts]
        strain = link.exaggeration.strain(pose.time, tips, placement.lift, elasticity.cartoon)
        whole = _whole(strain, elasticity.volume_gain)
        if not strain.is_none:
            posed = chains.stretched(posed, strain.of_limbs(chains.limb_of_node)) @ whole.T
        self._positions = posed
        anchors = chains.anchors(placed, posed, strain.of_limbs(chains.limb_of_bone), whole)
        nodes = PosedNodes(posed, placed.rotations)
        return Targets(self._shape(anchors, nodes), placement, nodes)

    def _shape(self, anchors: Anchors, nodes: PosedNodes) -> HandleTargets | SkinnedTargets:
        """What the surface follows: rings of handles around the bones."""
        thinning = 0.5 * self._surface.elasticity.volume_gain
        positions = self._skeleton.handle_positions(anchors, thinning)
        return HandleTargets(self._skeleton.handles, positions, self._weights)

    def delay(self, mapping: Mapping) -> None:
        """Go on with the same mapping but for its delays; what is remembered stays."""
        self.mapping = mapping
        if self._link is not None:
            self._link = replace(self._link, mapping=mapping)
            self._link.delays.delays = _delays(mapping)

    @property
    def _spread(self) -> bool:
        """Whether chains may follow one after the other, so that turns are remembered."""
        drives = self._link.mapping.drives if self._link is not None else ()
        return any(d.delay > 0.0 for d in drives) or len({d.source for d in drives}) < len(drives)

    def reset(self) -> None:
        """Forget the poses before: see `Driver.reset`."""
        link = self._link
        if link is not None:
            link.reset()
            self._weights = link.chains.weights(link.limb_release.weights)

    def pulls(self) -> NDArray[np.bool_]:
        """Return which of D drives pull at each edge (E, D): see `MappedDriver.pulls`."""
        if self._link is None:
            return np.zeros((len(self._surface.edges.ends), 0), dtype=np.bool_)
        return self._link.chains.pulls(self._surface.edges.ends)

    @property
    def parts(self) -> list[DrivenPart]:
        """The drives of the mapping, in words."""
        performer, character = self._performer, self._character
        gains = self.gains if len(self.gains) else np.ones(len(self.mapping.drives))
        return [
            DrivenPart(
                part_name(performer, self._performer_plan, drive.source),
                part_name(character.skeleton, character.plan, drive.target),
                drive.source,
                drive.target,
                RELATIVE,
                float(gain),
                drive.flip,
                drive.delay,
            )
            for drive, gain in zip(self.mapping.drives, gains, strict=True)
        ]

    @property
    def highlights(self) -> list[Highlight]:
        """The driven chains; each lights up with the joints that drive it."""
        return [
            Highlight(self._positions[list(drive.target)], drive.source[1:])
            for drive in self.mapping.drives
        ]

    def snapshot(self) -> PolylineState:
        """Return what drives, and what is remembered: see `Driver.snapshot`."""
        return PolylineState(
            mapping=self.mapping,
            view=self._view,
            gains=self.gains.copy(),
            positions=self._positions,
            weights=self._weights,
            link=None if self._link is None else self._link.snapshot(),
        )

    def restore(self, state: PolylineState) -> None:
        """Go back to a snapshot; what drove then drives again."""
        self._go_back_to(state.link)
        self.show(state.mapping, state.view)
        self.gains = state.gains.copy()
        self._positions, self._weights = state.positions, state.weights

    def _go_back_to(self, state: LinkState | None) -> None:
        if state is None:
            self._link = None
            return
        link = self._link
        if link is None or link.mapping is not state.mapping or link.rest is not state.rest:
            self.show(state.mapping, state.view)
            self.prepare((), state.rest)
        if self._link is not None:
            self._link.restore(state)


class SkinnedPolylineDriver(PolylineDriver):
    """A `PolylineDriver` whose surface follows by a skin, at the full amplitude of the performer.

    A limb turns by less only where its own surface would tear. Characters that stretch as a cartoon
    keep their rings, which can grow longer and thinner.
    """

    limits = StretchLimits(of_all=np.inf, of_limb=1.0)

    def _shape(self, anchors: Anchors, nodes: PosedNodes) -> HandleTargets | SkinnedTargets:
        if self._surface.elasticity.cartoon > 0.0:
            return super()._shape(anchors, nodes)
        return self._skeleton.skinned(nodes)


def _delays(mapping: Mapping) -> Array:
    """The delay [s] of each driven bone, chain after chain."""
    drives = mapping.drives
    bones = [len(drive.target) - 1 for drive in drives]
    return np.repeat([drive.delay for drive in drives], bones).astype(np.float64)


def _whole(strain: Strain, volume_gain: float) -> Array:
    """The linear map (3, 3) of a character that is stretched or squashed as a whole."""
    thin = strain.body ** (-0.5 * volume_gain)
    return np.diag([thin, strain.body, thin])
