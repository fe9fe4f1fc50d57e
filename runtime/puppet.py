"""A character on its strings: its limbs do what a performer's do, and its surface follows."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from devices.errors import InputError
from runtime.character import Character
from runtime.mapping import Drive, Mapping
from runtime.performer import Pose, Rest
from solvers.abstraction import abstract
from solvers.arap import ArapSolver
from solvers.binding import bind
from solvers.heading import turned
from solvers.polyline_motion import ChainRetarget
from solvers.skeleton_pose import SkeletonPose
from solvers.tree import Tree

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

STRAIGHT_ON = np.eye(3)  # how a capture device sees its performer


@dataclass(frozen=True, slots=True, eq=False)
class Motion:
    """A character at one moment.

    Attributes:
        vertices: (N, 3) [m] on the stage.
        node_positions: (K, 3) [m] on the stage.
        node_rotations: (K, 4) quaternions (x, y, z, w), world, from rest.
    """

    vertices: Array
    node_positions: Array
    node_rotations: Array


@dataclass(frozen=True, slots=True)
class Body:
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
        iterations: ARAP iterations a frame.
    """

    def __init__(self, character: Character, *, iterations: int = 2) -> None:
        self.character = character
        self.iterations = iterations
        skeleton = character.skeleton
        tree = Tree(skeleton.parents, skeleton.rest_positions)
        self.root = abstract(tree).root
        self.tree = tree.rerooted(self.root)
        self._binding = bind(
            character.vertices,
            character.faces,
            self.tree.parents,
            self.tree.positions,
            _bones_of_weights(character, self.tree.parents),
        )
        self._solver = ArapSolver(
            character.vertices,
            character.faces,
            self._binding.handles,
            groups=self._binding.anchor,
        )
        self._offsets = (
            character.vertices[self._binding.handles]
            - self.tree.positions[self._binding.pivot[self._binding.anchor]]
        )
        self.mapping = Mapping(())
        self._retargets: list[tuple[list[int], ChainRetarget]] = []
        self._source_rest: Rest | None = None
        self.rest()

    def take(self, mapping: Mapping, rest: Rest, view: Array, body: Body) -> None:
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
        roots = [self.root, chains[0][0]]
        if mapping.root is not None:
            roots.insert(1, mapping.root)
        for root in roots:
            try:
                self._drive(chains, root)
            except ValueError as error:
                refusal = error
            else:
                break
        else:
            raise InputError(
                f"{self.character.name} cannot be driven so: {refusal}; let every polyline lead "
                f"away from node {self.root} or from the start of the first, and none share a bone"
            ) from refusal
        self._retargets = [
            (
                list(drive.source),
                ChainRetarget(
                    rest.positions[list(drive.source)],
                    self.tree.positions[list(drive.target)],
                    STRAIGHT_ON,
                    view,
                    drive.flip,
                ),
            )
            for drive in mapping.drives
        ]
        self.mapping = mapping
        self._source_rest = rest
        self._body = body

    def _drive(self, chains: tuple[tuple[int, ...], ...], root: int) -> None:
        """Hold on to `root` and move the chains."""
        self._skeleton_pose = SkeletonPose(self.tree, root, chains)
        self._parents = self.tree.rerooted(root).parents
        self._driven = np.array([node for chain in chains for node in chain[1:]], dtype=np.int64)
        self._chains = chains
        node, pivot = self._binding.node, self._binding.pivot
        # A bone is known by its end that lies away from the root, which may not be the binding's.
        self._bone = np.where(self._parents[pivot] == node, pivot, node)
        self._bone[node == pivot] = -1
        self._retargets = []

    def show(self, mapping: Mapping) -> None:
        """Say what would drive it, without being driven."""
        self.mapping = mapping

    def rest(self) -> None:
        """Be driven by nothing and stand at rest."""
        self._drive((), self.root)
        self._body = Body()
        self._source_rest = None
        self._pose_nodes([])
        self._turn = self._lift = 0.0
        self._shift = np.zeros(3)

    def follow(self, pose: Pose) -> None:
        """Take over the performer's pose."""
        if self._source_rest is None:
            return
        rest = self._source_rest
        joints = pose.facing(rest.heading)
        self._pose_nodes(
            [retarget.rotations(joints[source]) for source, retarget in self._retargets]
        )
        self._turn = pose.heading - rest.heading if self._body.turns else 0.0
        self._lift = self._body.lift * float(pose.hips[1] - rest.height)

    def _pose_nodes(self, turns: list[Array]) -> None:
        self._rotations, self._positions = self._skeleton_pose.pose(turns)
        bones = self._rotations[np.maximum(self._parents, 0)]
        if len(self._driven):
            bones[self._driven] = np.concatenate(turns)
        self._bones = bones

    def deform(self) -> Motion:
        """Let the surface follow the nodes, and the whole follow the performer's body."""
        vertices = self._solver.solve(self._targets(), iterations=self.iterations)
        return self._with_body(vertices)

    def _targets(self) -> Array:
        """Where the handles (H, 3) [m] have to be."""
        anchors = np.where(
            (self._bone >= 0)[:, None],
            self._bones[self._bone],
            self._rotations[self._binding.node],
        )
        turn = Rotation.from_quat(anchors).as_matrix()[self._binding.anchor]
        pivots = self._positions[self._binding.pivot][self._binding.anchor]
        targets: Array = np.einsum("hij,hj->hi", turn, self._offsets) + pivots
        return targets

    def _with_body(self, vertices: Array) -> Motion:
        lift = self._lift
        if self._lift < 0.0:  # a lowered body must not sink into the floor
            lift = max(self._lift, -float(vertices[:, 1].min()))
        self._shift = np.array([0.0, lift, 0.0])
        whole = Rotation.from_rotvec([0.0, self._turn, 0.0])
        return Motion(
            vertices=self._on_stage(vertices),
            node_positions=self._on_stage(self._positions),
            node_rotations=(whole * Rotation.from_quat(self._rotations)).as_quat(),
        )

    def _on_stage(self, points: Array) -> Array:
        """Turn and lift points (n, 3) with the whole body."""
        return turned(points, self._turn, self.tree.positions[self.root]) + self._shift

    @property
    def chains(self) -> list[Array]:
        """Where the nodes of each chain of the mapping are, (k, 3) [m] each."""
        nodes = self._on_stage(self._positions)
        return [nodes[list(drive.target)] for drive in self.mapping.drives]


def _bones_of_weights(character: Character, parents: Indices) -> Indices | None:
    """The far end of the bone that each vertex belongs to, as the rig's weights say."""
    if character.weights is None:
        return None
    joint = np.asarray(character.weights.argmax(axis=1)).ravel()
    first_child = np.full(len(parents), -1, dtype=np.int64)
    for node in range(len(parents) - 1, -1, -1):
        if parents[node] >= 0:
            first_child[parents[node]] = node
    far: Indices = np.where(first_child[joint] >= 0, first_child[joint], joint)
    return far


def body_of(mapping: Mapping, legs: list[frozenset[int]], source: Array, target: Array) -> Body:
    """How far a character goes along with the performer's body: all the way when both legs drive.

    Args:
        mapping: what drives the character.
        legs: the joints of each of the performer's legs.
        source: (J, 3) [m] the performer's rest state.
        target: (K, 3) [m] the character's nodes at rest.
    """
    driving = [
        drive for drive in mapping.drives for leg in legs if len(leg.intersection(drive.source)) > 1
    ]
    if len(driving) < 2 or len(driving) < len(legs):
        return Body()
    return Body(turns=True, lift=_length(driving, target, source))


def _length(drives: list[Drive], target: Array, source: Array) -> float:
    """How long the driven chains are for each metre of those that drive them."""

    def total(points: Array, chain: tuple[int, ...]) -> float:
        return float(np.linalg.norm(np.diff(points[list(chain)], axis=0), axis=1).sum())

    ours = sum(total(target, drive.target) for drive in drives)
    theirs = sum(total(source, drive.source) for drive in drives)
    return ours / theirs if theirs > 0.0 else 0.0
