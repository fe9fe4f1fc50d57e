"""Make a body for a rig without a mesh: a wooden figure around its bones."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array, csr_array
from scipy.sparse.csgraph import shortest_path
from scipy.spatial import cKDTree
from scipy.spatial.distance import cdist

from devices.bodies.body_plan import SIDES
from devices.bodies.plan_by_names import plan_by_names
from devices.bodies.rest_heading import rest_heading
from devices.errors import InputError
from devices.skeleton import Skeleton
from runtime.characters.builtin.meshing import level_set, relaxed
from runtime.characters.builtin.sculpture import Sculpture
from runtime.characters.builtin.signed_distance import Field, smooth_union, tube

Array = NDArray[np.float64]
Faces = NDArray[np.int64]
Bones = NDArray[np.int64]

_SIZE = 1.7
"""The rig is scaled to this extent [m] for modelling; the signed distances expect metres."""
_PROFILE = (0.7, 1.0, 0.92, 0.62)
"""Radius of a limb from joint to joint, over the bone's radius."""
_SLENDER = 0.5
"""Radius of a body that is one chain, over that of the trunk of one with limbs."""
_CHAIN = 0.75  # of the length of all bones: one chain that is longer has no limbs
_UPRIGHT = 0.8  # cosine to the vertical of a spine that carries a head as a person's does
_HEAD = (0.13, 0.06, 0.19)
"""Radius of a head, and the heights of its lower and upper ball above the skull's joint, over the
length of trunk and neck: of a person whose head is as high as an eighth of the whole."""
_NOSE = (0.05, 0.05, 0.15)
"""Radius of a nose, its height above the lower ball, and how far in front of it it ends."""
_MOST_SAMPLES = 2_000_000
"""About as many points are sampled from the signed distance."""
_FEWEST, _WANTED, _MOST = 3_000, 5_000, 8_000  # vertices


class _Head(NamedTuple):
    """A head: two bones without joints.

    Attributes:
        joint: that carries it.
        points: (3, 3) [m] the lower and the upper end of its axis, and the tip of its nose.
        radii: (2,) [m] of its axis and its nose.
    """

    joint: int
    points: Array
    radii: Array


def body_around(skeleton: Skeleton) -> tuple[Array, Faces, csr_array]:
    """Make a watertight body around the bones of a skeleton in any unit.

    Returns:
        vertices (n, 3) in the skeleton's unit, about 3000 to 8000; faces (m, 3); weights (n, J):
        each vertex follows the joint that its nearest bone turns about.

    Raises:
        InputError: all joints stand at one place, or the optional package manifold3d is missing.
    """
    rest = skeleton.rest_positions
    lower, extent = rest.min(axis=0), float(np.linalg.norm(np.ptp(rest, axis=0)))
    scale = _SIZE / max(extent, 1e-12)
    positions = (rest - lower) * scale
    joints = np.flatnonzero(skeleton.parents >= 0)
    bones = np.column_stack([skeleton.parents[joints], joints])
    bones = bones[np.linalg.norm(np.diff(positions[bones], axis=1), axis=(1, 2)) > 1e-6]
    if not len(bones):
        raise InputError("all joints of the rig stand at one place; no body fits round it")
    radii, owners = bone_radii(positions, bones), bones[:, 0]
    if _is_one_chain(positions, bones):
        radii *= _SLENDER
    head = _head(skeleton, positions)
    if head is not None:
        count = len(positions)
        positions = np.concatenate([positions, head.points])
        bones = np.concatenate([bones, count + np.array([[0, 1], [0, 2]])])
        radii = np.concatenate([radii, head.radii])
        owners = np.append(owners, [head.joint, head.joint])
    try:
        vertices, faces = _meshed(positions, bones, radii)
    except ImportError as error:
        raise InputError(
            f"a body for a rig without a mesh needs the extra ({error.name}): "
            "pip install 'bunraku[characters]'"
        ) from None
    owner = owners[_nearest_bone(vertices, positions, bones, radii)]
    ones, rows = np.ones(len(vertices)), np.arange(len(vertices))
    weights = coo_array((ones, (rows, owner)), shape=(len(vertices), len(rest)))
    return vertices / scale + lower, faces, csr_array(weights.tocsr())


def bone_radii(positions: Array, bones: Bones) -> Array:
    """The radius (b,) of each bone, from the length of all bones that it carries.

    Limbs thin out like branches: the cross-section of each is proportional to the length of all
    bones that it carries (L. da Vinci's rule of trees). Limbs side by side leave room between them.
    """
    length = np.linalg.norm(positions[bones[:, 1]] - positions[bones[:, 0]], axis=1)
    into = {int(joint): number for number, joint in enumerate(bones[:, 1])}
    carried = length.copy()
    for number in _leaves_first(bones):
        above = into.get(int(bones[number, 0]))
        if above is not None:
            carried[above] += carried[number]
    radii = 0.08 * _SIZE * np.sqrt(carried / length.sum())
    # A head, the end of a bone on the middle plane, is twice as thick.
    ends = ~np.isin(bones[:, 1], bones[:, 0])
    middle = np.abs(positions[bones] - np.median(positions, axis=0))[..., 0].max(axis=1)
    radii[ends & (middle < 0.02 * _SIZE)] *= 2.0
    bounded: Array = np.minimum(radii, np.maximum(0.4 * _room(positions, bones), 0.6 * radii))
    return np.clip(bounded, 0.006 * _SIZE, 0.06 * _SIZE)


def _head(skeleton: Skeleton, positions: Array) -> _Head | None:
    """The head of a body that stands upright, with the joints at (J, 3) [m]; None of any other.

    The bone of a head often ends within it, so that it does not say how large it is.
    """
    plan = plan_by_names(skeleton)
    if plan is None or plan.skull is None or min(len(plan.arms), len(plan.legs)) < len(SIDES):
        return None
    skull, hips = positions[plan.skull], positions[plan.hips]
    tall = float(np.linalg.norm(skull - hips))
    if not skull[1] - hips[1] > _UPRIGHT * tall > 0.0:
        return None
    facing = rest_heading(skeleton, plan)
    up, front = np.array([0.0, 1.0, 0.0]), np.array([np.sin(facing), 0.0, np.cos(facing)])
    radius, low, high = tall * np.array(_HEAD)
    thick, above, ahead = tall * np.array(_NOSE)
    chin = skull + low * up
    points = np.array([chin, skull + high * up, chin + above * up + ahead * front])
    return _Head(plan.skull, points, np.array([radius, thick]))


def _is_one_chain(positions: Array, bones: Bones) -> bool:
    """Whether a body is one chain with short branches at most, as a snake's is."""
    path = _paths(positions, bones)
    length = float(np.linalg.norm(np.diff(positions[bones], axis=1), axis=2).sum())
    return bool(path[np.isfinite(path)].max() > _CHAIN * length)


def _paths(positions: Array, bones: Bones) -> Array:
    """The lengths (J, J) [m] of the ways along the bones; infinite where there is none."""
    length = np.linalg.norm(positions[bones[:, 1]] - positions[bones[:, 0]], axis=1)
    count = len(positions)
    links = coo_array((np.maximum(length, 1e-9), (bones[:, 0], bones[:, 1])), (count, count))
    paths: Array = shortest_path(links.tocsr(), directed=False)
    return paths


def _room(positions: Array, bones: Bones) -> Array:
    """The distance (b,) from each bone to those near in space and far along the skeleton."""
    start, end = positions[bones[:, 0]], positions[bones[:, 1]]
    path = _paths(positions, bones)
    along = np.linspace(0.0, 1.0, 7)
    samples = start[:, None] + along[:, None] * (end - start)[:, None]  # (b, 7, 3)
    room = np.full(len(bones), np.inf)
    for number, (first, last) in enumerate(bones):
        gap = (
            cdist(samples[number], samples.reshape(-1, 3))
            .reshape(len(along), -1, len(along))
            .min(axis=(0, 2))
        )
        detour = np.minimum(path[first], path[last])[bones].min(axis=1)
        room[number] = np.min(gap, where=detour > 2.5 * gap, initial=np.inf)
    return room


def _leaves_first(bones: Bones) -> list[int]:
    below: dict[int, list[int]] = {}
    for number, (parent, _) in enumerate(bones):
        below.setdefault(int(parent), []).append(number)
    roots = set(bones[:, 0].tolist()) - set(bones[:, 1].tolist())
    order = [number for root in roots for number in below[root]]
    for number in order:
        order.extend(below.get(int(bones[number, 1]), []))
    return order[::-1]


def _solid(positions: Array, bones: Bones, radii: Array, air: float) -> Field:
    """The body's signed distance; beyond `air` [m] from it, only a bound."""
    limbs = []
    along = np.linspace(0.0, 1.0, len(_PROFILE))[:, None]
    for (start, end), radius in zip(bones, radii, strict=True):
        path = positions[start] + along * (positions[end] - positions[start])
        limbs.append(tube(path, radius * np.array(_PROFILE)))
    body = smooth_union(0.008 * _SIZE, *limbs)
    spacing = float(np.min(radii))
    marks = cKDTree(np.concatenate([_marks(positions[a], positions[b], spacing) for a, b in bones]))
    reach = float(radii.max()) + spacing + air

    def field(points: Array) -> Array:
        distance: Array = marks.query(points, distance_upper_bound=reach)[0]
        near = np.isfinite(distance)
        distance[~near] = air
        distance[near] = body(points[near])
        return distance

    return field


def _marks(start: Array, end: Array, spacing: float) -> Array:
    """Points (k, 3) on a bone, no farther apart than `spacing`."""
    count = int(np.linalg.norm(end - start) / spacing) + 2
    marks: Array = start + np.linspace(0.0, 1.0, count)[:, None] * (end - start)
    return marks


def _meshed(positions: Array, bones: Bones, radii: Array) -> tuple[Array, Faces]:
    """The body's mesh, with an edge length that gives about `_WANTED` vertices."""
    length = np.linalg.norm(positions[bones[:, 1]] - positions[bones[:, 0]], axis=1)
    area = float(np.sum(2.0 * np.pi * radii * length))
    edge = 2.0 * np.sqrt(area / (0.87 * _WANTED))
    # The first, coarse mesh only measures the area; the next ones are close.
    vertices, faces, solid = _level_set(positions, bones, radii, edge)
    finest = float(np.cbrt(2.0 * np.prod(np.ptp(positions, axis=0) + 0.2 * _SIZE) / _MOST_SAMPLES))
    for _ in range(3):
        edge = max(finest, edge * float(np.sqrt(len(vertices) / _WANTED)))
        vertices, faces, solid = _level_set(positions, bones, radii, edge)
        if _FEWEST <= len(vertices) <= _MOST:
            break
    return relaxed(vertices, faces, solid, edge, rounds=4), faces


def _level_set(
    positions: Array, bones: Bones, radii: Array, edge: float
) -> tuple[Array, Faces, Field]:
    thick = np.maximum(radii, 0.8 * edge)  # limbs thinner than an edge would fall to pieces
    air = 2.0 * edge
    solid = _solid(positions, bones, thick, air)
    lower, upper = positions.min(axis=0), positions.max(axis=0)
    margin = float(thick.max()) + air
    sculpture = Sculpture(
        solid=solid,
        lower=tuple((lower - margin).tolist()),
        upper=tuple((upper + margin).tolist()),
        edge=edge,
        base="",
        paints=(),
        limbs=(),
    )
    return *level_set(sculpture), solid


def _nearest_bone(points: Array, positions: Array, bones: Bones, radii: Array) -> Faces:
    nearest = np.full(len(points), np.inf)
    owner = np.zeros(len(points), dtype=np.int64)
    for number, (start, end) in enumerate(bones):
        bone = positions[end] - positions[start]
        along = np.clip((points - positions[start]) @ bone / (bone @ bone), 0.0, 1.0)
        gap = np.linalg.norm(points - positions[start] - along[:, None] * bone, axis=1)
        closer = gap - radii[number] < nearest
        nearest[closer], owner[closer] = (gap - radii[number])[closer], number
    return owner
