"""Fit a skeleton of rigid bones to recorded joints: constant bone lengths, one rotation per joint.

The distances of a sensor's joints vary; animation formats have bones that only rotate. Lengths are
medians over the recording; rotations point every bone to its seen position.
Source of the fit of one joint's bones: Kabsch 1976, "A solution for the best rotation to relate
two sets of vectors".
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from devices.skeleton import Skeleton

Array = NDArray[np.float64]

_PRIOR = 1e-6  # weight of the known rotation, for the degrees of freedom that bones leave open
_ROUNDS = 3  # of fitting rotations to bones and bones to rotations
_STEADY = 0.1  # of its length that a bone may deviate in its parent's frame to count as carried
_SLIDES = 0.5  # of its length by which a bone must vary to count as sliding
_SLIDES_FAR = 0.1  # [m] that it must vary at least
_EXACT = (
    1e-4  # of its length that most bones deviate at most if rotations do not come from a sensor
)
_EXACT_FAR = 1e-3  # [m] that a bone must then deviate to count as sliding


@dataclass(frozen=True, slots=True, eq=False)
class RigidMotion:
    """A skeleton of rigid bones and its motion.

    Attributes:
        skeleton: its rest positions are the fitted ones.
        root: (T, 3) [m] positions of the root.
        rotations: (T, J, 3, 3) world, since the rest pose.
        slides: positions (T, 3) [m] in the parent's frame of joints without a rigid bone, such as
            hips that walk away from a fixed root.
    """

    skeleton: Skeleton
    root: Array
    rotations: Array
    slides: Mapping[int, Array] = field(default_factory=dict)

    def positions(self) -> Array:
        """Return the joint positions (T, J, 3) [m]."""
        skeleton = self.skeleton
        places = np.empty((len(self.root), len(skeleton.names), 3))
        for joint in skeleton.order:
            parent = int(skeleton.parents[joint])
            if parent < 0:
                places[:, joint] = self.root
                continue
            bone = skeleton.rest_positions[joint] - skeleton.rest_positions[parent]
            bone = self.slides.get(joint, np.broadcast_to(bone, self.root.shape))
            turned = np.einsum("tij,tj->ti", self.rotations[:, parent], bone)
            places[:, joint] = places[:, parent] + turned
        return places


def fit_rigid_bones(
    skeleton: Skeleton, positions: Array, rotations: Array | None = None
) -> RigidMotion:
    """Return the rigid motion nearest to recorded joints.

    Rotations of the source are kept where they carry the source's own bones, as in a BVH file; they
    determine the twist that positions leave open. Elsewhere a joint twists with its parent.

    Args:
        skeleton: of the joints; its rest pose has zero rotations.
        positions: (T, J, 3) [m], all finite.
        rotations: (T, J, 4) joint to world, in any frame of each joint; NaN where unknown.
    """
    bones = _bones(skeleton, positions)
    lengths = np.linalg.norm(bones, axis=2)
    sliding = _sliding(lengths)
    own = None
    if rotations is not None:
        own, exact = _since_rest(skeleton, bones, _matrices(rotations), sliding)
        sliding = sliding if exact is None else exact
    rigid = np.where(sliding[:, None], 0.0, bones)  # a sliding joint does not turn its parent
    rest = _with_lengths(skeleton, np.where(sliding, 0.0, np.median(lengths, axis=0)))
    turned = aim_all(skeleton, rest, rigid, own)
    for _ in range(_ROUNDS):
        rest = _in_parents_frame(skeleton, rigid, turned)
        turned = aim_all(skeleton, rest, rigid, own)
    slides = {
        int(joint): np.einsum("tji,tj->ti", turned[:, skeleton.parents[joint]], bones[:, joint])
        for joint in np.flatnonzero(sliding)
    }
    for joint, way in slides.items():
        rest[joint] = _resting(skeleton, joint, way)
    fitted = Skeleton(skeleton.names, skeleton.parents, _stood(skeleton, rest))
    return RigidMotion(fitted, positions[:, skeleton.root], turned, slides)


def aim_all(skeleton: Skeleton, rest: Array, bones: Array, own: Array | None) -> Array:
    """Return world rotations (T, J, 3, 3) since rest that turn each joint's bones to given vectors.

    Args:
        skeleton: the tree.
        rest: (J, 3) offset of each joint from its parent at rest.
        bones: (T, J, 3) the offsets in every frame.
        own: (T, J, 3, 3) known rotations since rest; NaN, or None, where a joint turns with its
            parent.
    """
    turned = np.empty((*bones.shape[:2], 3, 3))
    for joint in skeleton.order:
        parent = int(skeleton.parents[joint])
        inherited = np.broadcast_to(np.eye(3), (len(bones), 3, 3))
        prior = inherited if parent < 0 else turned[:, parent]
        if own is not None:
            known = np.isfinite(own[:, joint]).all(axis=(1, 2), keepdims=True)
            prior = np.where(known, own[:, joint], prior)
        children = np.flatnonzero(skeleton.parents == joint)
        turned[:, joint] = aimed(prior, rest[children], bones[:, children])
    return turned


def aimed(prior: Array, rest: Array, seen: Array) -> Array:
    """Return the rotations (T, 3, 3) nearest to `prior` that turn rest vectors to seen ones.

    Least squares; the prior, with a small weight, determines the twist that the vectors leave open.

    Args:
        prior: (T, 3, 3).
        rest: (C, 3).
        seen: (T, C, 3).
    """
    size = float(np.sum(rest**2))
    if size == 0.0:
        return prior
    turned = np.einsum("tij,cj->tci", prior, rest)
    covariance = np.einsum("tci,tcj->tij", seen, turned) + _PRIOR * size * np.eye(3)
    u, _, vt = np.linalg.svd(covariance)
    u[:, :, 2] *= np.linalg.det(u @ vt)[:, None]  # no reflections
    nearest: Array = u @ vt @ prior
    return nearest


def as_matrices(quaternions: Array) -> Array:
    """Return rotation matrices (..., 3, 3) of unit quaternions (..., 4)."""
    flat = Rotation.from_quat(quaternions.reshape(-1, 4)).as_matrix()
    matrices: Array = flat.reshape(*quaternions.shape[:-1], 3, 3)
    return matrices


def _bones(skeleton: Skeleton, positions: Array) -> Array:
    """Offset (T, J, 3) of each joint from its parent; 0 for the root."""
    parents = np.where(skeleton.parents < 0, skeleton.root, skeleton.parents)
    bones: Array = positions - positions[:, parents]
    return bones


def _sliding(lengths: Array) -> NDArray[np.bool_]:
    """Which joints (J,) slide: their distances (T, J) from the parent vary too much for a bone."""
    least, middle, most = np.percentile(lengths, (1, 50, 99), axis=0)
    sliding: NDArray[np.bool_] = most - least > np.maximum(_SLIDES * middle, _SLIDES_FAR)
    return sliding


def _resting(skeleton: Skeleton, joint: int, way: Array) -> Array:
    """Rest offset (3,) of a sliding joint: that of the rest pose if it is near the path, else mean.

    BVH readers decide whether positions replace an offset or add to it by their distance to the
    offset and to zero; the mean is never farther away than zero.
    """
    parent = skeleton.parents[joint]
    rest: Array = skeleton.rest_positions[joint] - skeleton.rest_positions[parent]
    near = np.square(way - rest).sum() < np.square(way).sum()
    return rest if near else np.mean(way, axis=0)


def _stood(skeleton: Skeleton, rest: Array) -> Array:
    """Joint positions (J, 3) from offsets to the parents; the root at its rest position."""
    places = np.empty((len(skeleton.names), 3))
    for joint in skeleton.order:
        parent = int(skeleton.parents[joint])
        places[joint] = (
            skeleton.rest_positions[joint] if parent < 0 else places[parent] + rest[joint]
        )
    return places


def _with_lengths(skeleton: Skeleton, lengths: Array) -> Array:
    """Bones (J, 3) with the directions of the rest pose and the given lengths (J,)."""
    rest = _bones(skeleton, skeleton.rest_positions[None])[0]
    usual = np.linalg.norm(rest, axis=1)
    scale = np.divide(lengths, usual, out=np.zeros_like(usual), where=usual > 1e-9)
    scaled: Array = rest * scale[:, None]
    return scaled


def _in_parents_frame(skeleton: Skeleton, bones: Array, turned: Array) -> Array:
    """Median of each bone (J, 3) in its parent's frame."""
    rest = np.zeros((len(skeleton.names), 3))
    for joint in np.flatnonzero(skeleton.parents >= 0):
        back = np.einsum("tji,tj->ti", turned[:, skeleton.parents[joint]], bones[:, joint])
        middle = np.median(back, axis=0)
        length = np.linalg.norm(middle)
        # The median of each coordinate is a little short if directions vary.
        usual = np.median(np.linalg.norm(bones[:, joint], axis=1))
        rest[joint] = middle * (usual / length) if length > 1e-9 else middle
    return rest


def _matrices(rotations: Array) -> Array:
    """Rotation matrices (T, J, 3, 3) of quaternions (T, J, 4); NaN where unknown."""
    unknown = np.isnan(rotations).any(axis=2)
    unit = rotations.copy()
    unit[unknown] = [0.0, 0.0, 0.0, 1.0]
    matrices = as_matrices(unit)
    matrices[unknown] = np.nan
    return matrices


def _since_rest(
    skeleton: Skeleton, bones: Array, matrices: Array, sliding: NDArray[np.bool_]
) -> tuple[Array, NDArray[np.bool_] | None]:
    """The source's rotations as world rotations since rest (T, J, 3, 3), and the sliding joints.

    Each joint's own frame is turned, once for the whole recording, so that its bones lie as they do
    at rest. Rotations that do not carry their bones are NaN. If the rotations carry nearly all
    bones exactly, the few others (J,) count as sliding, however little they move; else that is
    None.
    """
    local, usual, most = _local_bones(skeleton, bones, matrices)
    lengths = np.linalg.norm(local, axis=1)
    steady = (usual <= _STEADY * lengths) & (lengths > 0) & ~sliding
    exact = None
    bone = skeleton.parents >= 0
    if 2 * np.count_nonzero(usual[bone] <= _EXACT * lengths[bone]) > np.count_nonzero(bone):
        exact = (most > _EXACT_FAR) & np.isfinite(most)
        sliding, steady = exact, steady & ~exact
    rest = _bones(skeleton, skeleton.rest_positions[None])[0]
    common = aimed(np.eye(3)[None], rest[steady], local[None, steady])
    frames = np.empty((len(skeleton.names), 3, 3))
    for joint in skeleton.order:
        own = np.flatnonzero((skeleton.parents == joint) & steady)
        frames[joint] = aimed(common, rest[own], local[None, own])[0]
    useless = np.isin(np.arange(len(frames)), skeleton.parents[~steady & ~sliding])
    useless |= not steady.any()
    matrices[:, useless] = np.nan
    turned: Array = np.einsum("tkij,kjl->tkil", matrices, frames)
    return turned, exact


def _local_bones(skeleton: Skeleton, bones: Array, matrices: Array) -> tuple[Array, Array, Array]:
    """Each bone (J, 3) in its parent's own frame, and its deviation (J,) from there [m]: median and
    99th percentile; infinite if no frame is known."""
    local = np.zeros((len(skeleton.names), 3))
    usual, most = np.full((2, len(skeleton.names)), np.inf)
    for joint in np.flatnonzero(skeleton.parents >= 0):
        back = np.einsum("tji,tj->ti", matrices[:, skeleton.parents[joint]], bones[:, joint])
        back = back[np.isfinite(back).all(axis=1)]
        if len(back):
            local[joint] = np.median(back, axis=0)
            strays = np.linalg.norm(back - local[joint], axis=1)
            usual[joint], most[joint] = np.percentile(strays, (50, 99))
    return local, usual, most
