"""A character on its strings: its limbs do what a performer's do, and its surface follows."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from devices.errors import InputError
from runtime.characters.character import Character
from runtime.driving.exaggeration import Exaggeration, Strain
from runtime.driving.limb_release import LimbRelease
from runtime.driving.mapping import Drive, Mapping
from runtime.driving.performer import Pose, Rest
from runtime.puppet.deformable_surface import Anchors, DeformableSurface
from solvers.deform.arap_cells import SPOKES
from solvers.deform.handles import HARD
from solvers.retarget.abstraction import abstract
from solvers.retarget.chain_retargets import ChainRetargets
from solvers.retarget.ground_contact import stand, turned_rotations
from solvers.retarget.heading import turned
from solvers.retarget.polyline_motion import map_chain
from solvers.skeleton.forward_kinematics import SkeletonPose
from solvers.skeleton.tree import Tree

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

STRAIGHT_ON = np.eye(3)  # how a capture device sees its performer
FROM_REST = 4  # iterations towards a pose from none


@dataclass(frozen=True, slots=True, eq=False)
class Motion:
    """A character at one moment.

    Attributes:
        vertices: (N, 3) [m] on the stage; overwritten two motions later.
        node_positions: (K, 3) [m] on the stage.
        node_rotations: (K, 4) quaternions (x, y, z, w), world, from rest.
    """

    vertices: Array
    node_positions: Array
    node_rotations: Array


@dataclass(frozen=True, slots=True)
class RootMotion:
    """How far the whole character goes along with the whole performer.

    Attributes:
        turns: whether it turns as the performer turns.
        lift: how much it rises for each metre that the performer's root rises.
    """

    turns: bool = False
    lift: float = 0.0


class Puppet:
    """Binds a character once and performs with it, frame after frame.

    Every bone of the character is held from the start, whatever drives it, so that another match
    changes what the bones do and nothing else: nothing is factored again while a show runs.

    Args:
        character: who performs.
        iterations: of the solver, a frame; where there are several, the last comes after the
            surface is shown: see `settle`.
        energy: what is kept as rigid as possible: see `ArapSolver`.

    Attributes:
        tree: the character's nodes, hung on `root`.
        root: the node that stays in place.
        mapping: what drives it, or would.
        surface: its surface, on its bones.
        binding: how the surface hangs on the nodes.
        gains: for each drive the share of the performer's turns that is carried over, in (0, 1].
    """

    def __init__(self, character: Character, *, iterations: int = 2, energy: str = SPOKES) -> None:
        self.character = character
        self.iterations = iterations
        skeleton = character.skeleton
        tree = Tree(skeleton.parents, skeleton.rest_positions)
        self.root = abstract(tree).root
        self.tree = tree.rerooted(self.root)
        self.surface = DeformableSurface(character, self.tree, energy=energy)
        self.binding = self.surface.binding
        self._standing = [np.empty_like(character.vertices) for _ in range(2)]
        self.mapping = Mapping(())
        self.gains = np.ones(0)
        self._source_rest: Rest | None = None
        self.rest()

    def take(self, mapping: Mapping, rest: Rest, view: Array, body: RootMotion) -> None:
        """Be driven as `mapping` says from now on; the performer's rest state meets its own.

        Args:
            mapping: which joints drive which nodes.
            rest: the performer's rest state.
            view: (3, 3) rotation from the stage to the camera.
            body: how far it goes along with the whole performer.

        Raises:
            InputError: chains that share a bone, or lead towards one another.
        """
        chains = tuple(drive.target for drive in mapping.drives)
        # Where any node will do, the nearest start of a chain does too, and moves it alike: no
        # driven bone lies between them.
        for root in dict.fromkeys((self.root, *(chain[0] for chain in chains))):
            try:
                self._drive(chains, root)
            except ValueError as error:
                refusal = error
            else:
                break
        else:
            raise InputError(
                f"{self.character.name} cannot be driven so: {refusal}; let all polylines lead "
                f"away from one node, as from {self.root}, and none share a bone"
            ) from refusal
        maps = [
            map_chain(
                rest.positions[list(drive.source)],
                self.tree.positions[list(drive.target)],
                STRAIGHT_ON,
                view,
                drive.flip,
            )
            for drive in mapping.drives
        ]
        self._retargets = ChainRetargets(maps, [drive.source for drive in mapping.drives])
        self._source_tips = np.array([drive.source[-1] for drive in mapping.drives])
        self.mapping = mapping
        self.gains = np.ones(len(mapping.drives))
        self._source_rest = rest
        self._body = body

    def _drive(self, chains: tuple[tuple[int, ...], ...], root: int) -> None:
        """Hold on to `root` and move the chains."""
        self._skeleton_pose = SkeletonPose(self.tree, root, chains)
        oriented = self.tree.rerooted(root)
        self._parents, self._order = oriented.parents, oriented.order
        self._chains = chains
        self._starts = np.array([chain[0] for chain in chains], dtype=np.int64)
        self._tips = np.array([chain[-1] for chain in chains], dtype=np.int64)
        self._limb_of_node = np.full(len(self.tree), -1, dtype=np.int64)  # whose bone ends here
        for number, chain in enumerate(chains):
            self._limb_of_node[list(chain[1:])] = number
        node, pivot = self.binding.node, self.binding.pivot
        # A bone is known by its end that lies away from the root, which may not be the binding's.
        self._bone = np.where(self._parents[pivot] == node, pivot, node)
        self._bone[node == pivot] = -1
        # Rows of `Placed.turns`: an anchor without a bone turns with its node.
        self._turn_of_anchor = np.where(self._bone >= 0, self._bone + len(self.tree), node)
        self._limb_of_bone = np.where(self._bone >= 0, self._limb_of_node[self._bone], -1)
        self._retargets = ChainRetargets((), ())
        lengths = [_chain_length(self.tree.positions, chain) for chain in chains]
        height = float(np.ptp(self.character.vertices[:, 1]))
        self._exaggeration = Exaggeration(np.array(lengths), height)
        self._limb_release = LimbRelease(len(chains))
        self._seen = np.ones(len(chains), dtype=np.bool_)
        self._limb_of_anchor = self._chain_above()[np.where(self._bone >= 0, self._bone, node)]
        self.surface.weigh(np.full(len(node), HARD))

    def _chain_above(self) -> Indices:
        """For each node the chain that moves it, or that it rides on; -1 for none."""
        chain_of = self._limb_of_node.copy()
        for node in self._order:
            if chain_of[node] < 0 and self._parents[node] >= 0:
                chain_of[node] = chain_of[self._parents[node]]
        return chain_of

    def attempt(self, pose: Pose) -> tuple[Array, Array]:
        """Strike a pose as if none had been struck before.

        Returns:
            (2, 3) [m] least and greatest corner of what it fills on the stage, and (E,) the
            relative change of length of the edges of `surface`.
        """
        self.forget()
        self.follow(pose)
        still = Strain(np.ones(len(self._chains)), 1.0)
        deformed = self.surface.deform(self._anchors(still), FROM_REST)
        seen = self._with_body(deformed).vertices
        box = np.array([seen.min(axis=0), seen.max(axis=0)])
        return box, self.surface.edges.stretch(deformed)

    def forget(self) -> None:
        """Go on as if no pose had been struck."""
        self.surface.reset()
        self._retargets.reset()

    def pulls(self) -> NDArray[np.bool_]:
        """Which of D drives pull at each edge (E, D): they bend it, or move one end only."""
        bent = np.zeros((len(self.tree), len(self._chains)), dtype=bool)
        for number, chain in enumerate(self._chains):
            bent[list(chain[1:]), number] = True
        moved = bent.copy()
        for node in self._order:
            if self._parents[node] >= 0:
                moved[node] |= moved[self._parents[node]]
        bone = np.where(self._bone >= 0, self._bone, self.binding.node)
        near, far = bone[self.binding.owner][self.surface.edges.ends].T
        pulls: NDArray[np.bool_] = bent[near] | bent[far] | (moved[near] != moved[far])
        return pulls

    def limb(self, chain: tuple[int, ...]) -> tuple[int, ...]:
        """Give the part of a chain of nodes that lies outside the trunk, two nodes at least."""
        start = 0
        while start + 2 < len(chain) and self.binding.inside[chain[start + 1]]:
            start += 1
        return chain[start:]

    def show(self, mapping: Mapping) -> None:
        """Say what would drive it, without being driven."""
        self.mapping = mapping

    def rest(self) -> None:
        """Be driven by nothing and stand at rest."""
        self._drive((), self.root)
        self._body = RootMotion()
        self._source_rest = None
        self._pose_nodes(np.zeros((0, 4)))
        self._turn = self._lift = self._time = 0.0
        self._shift = np.zeros(3)

    @property
    def source_rest(self) -> Rest | None:
        """The performer's rest state; None while nobody drives."""
        return self._source_rest

    def follow(self, pose: Pose) -> None:
        """Take over the performer's pose."""
        if self._source_rest is None:
            return
        rest = self._source_rest
        self._pose_nodes(self._retargets.rotations(pose.facing(rest.heading), self.gains))
        self._turn = pose.heading - rest.heading if self._body.turns else 0.0
        self._lift = self._body.lift * float(pose.hips[1] - rest.height)
        self._time = pose.time
        self._seen = ~pose.filled[self._source_tips]

    def _pose_nodes(self, turns: Array) -> None:
        """Turn the bones of all chains, one chain after another, by (B, 4) from rest."""
        self._placed = self._skeleton_pose.place(turns)
        self._positions = self._placed.positions

    def deform(self) -> Motion:
        """Let the surface follow the nodes, and the whole follow the performer's body."""
        if self._limb_release.follow(self._time, self._seen):
            self.surface.weigh(np.append(self._limb_release.weights, HARD)[self._limb_of_anchor])
        strain = self._strain()
        self._positions = self._stretched(strain)
        return self._with_body(self.surface.deform(self._anchors(strain), self._before_shown))

    def settle(self) -> None:
        """Take the iterations that are left of this frame, now that the surface has been shown.

        A frame is seen an iteration earlier, and the next starts as near as if it had waited.
        """
        self.surface.settle(self.iterations - self._before_shown)

    @property
    def _before_shown(self) -> int:
        return max(self.iterations - 1, 1)

    def _strain(self) -> Strain:
        """How far the character's own motion stretches it."""
        amount = self.surface.elasticity.cartoon
        posed = self._placed.positions
        tips = posed[self._tips] - posed[self._starts]
        return self._exaggeration.strain(self._time, tips, self._lift, amount)

    def _stretched(self, strain: Strain) -> Array:
        """Where the nodes are (K, 3) [m] once limbs and the whole are stretched."""
        posed = self._placed.positions
        if strain.is_none:
            return posed
        shares = strain.of_limbs(self._limb_of_node)
        return self._skeleton_pose.stretched(posed, shares) @ self._whole(strain).T

    def _whole(self, strain: Strain) -> Array:
        thin = strain.body ** (-0.5 * self.surface.elasticity.volume_gain)
        return np.diag([thin, strain.body, thin])

    def _anchors(self, strain: Strain) -> Anchors:
        """Where the bones take the anchors."""
        turns = self._placed.turns[self._turn_of_anchor]
        pivots = self._positions[self.binding.pivot]
        return Anchors(turns, pivots, strain.of_limbs(self._limb_of_bone), self._whole(strain))

    def _with_body(self, deformed: Array) -> Motion:
        vertices = self.surface.cover(deformed)
        self._standing.reverse()
        standing = self._standing[0]
        about = self.tree.positions[self.root]
        rise = stand(vertices, self._turn, about, self._lift, standing)
        self._shift = np.array([0.0, rise, 0.0])
        return Motion(
            vertices=standing,
            node_positions=self._on_stage(self._positions),
            node_rotations=turned_rotations(self._placed.rotations, self._turn),
        )

    def _on_stage(self, points: Array) -> Array:
        """Turn and lift points (n, 3) with the whole body."""
        return turned(points, self._turn, self.tree.positions[self.root]) + self._shift

    @property
    def chains(self) -> list[Array]:
        """Where the nodes of each chain of the mapping are, (k, 3) [m] each."""
        nodes = self._on_stage(self._positions)
        return [nodes[list(drive.target)] for drive in self.mapping.drives]


def root_motion(
    mapping: Mapping, legs: list[frozenset[int]], source: Array, target: Array
) -> RootMotion:
    """How far a character goes along with the performer's body: all the way when both legs drive.

    Args:
        mapping: what drives the character.
        legs: the joints of each of the performer's legs.
        source: (J, 3) [m] the performer's rest state.
        target: (K, 3) [m] the character's nodes at rest.
    """
    driving = [
        [drive for drive in mapping.drives if len(leg.intersection(drive.source)) > 1]
        for leg in legs
    ]
    if len(legs) < 2 or not all(driving):
        return RootMotion()
    legs_drive = [drive for drives in driving for drive in drives]
    return RootMotion(turns=True, lift=_length(legs_drive, target, source))


def _length(drives: list[Drive], target: Array, source: Array) -> float:
    """How long the driven chains are for each metre of those that drive them."""

    ours = sum(_chain_length(target, drive.target) for drive in drives)
    theirs = sum(_chain_length(source, drive.source) for drive in drives)
    return ours / theirs if theirs > 0.0 else 0.0


def _chain_length(points: Array, chain: tuple[int, ...]) -> float:
    return float(np.linalg.norm(np.diff(points[list(chain)], axis=0), axis=1).sum())
