"""A body for a rig that comes without one: a lay figure of turned wood around its bones."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array, csr_array

from devices.errors import InputError
from devices.skeleton import Skeleton
from runtime.characters.builtin.meshing import level_set, relaxed
from runtime.characters.builtin.sculpture import Sculpture
from runtime.characters.builtin.signed_distance import Field, smooth_union, tube

Array = NDArray[np.float64]
Faces = NDArray[np.int64]
Bones = NDArray[np.int64]

_SIZE = 1.7
"""The rig is scaled to this extent [m] to be modelled: the signed distances are made for metres."""
_PROFILE = (0.70, 0.95, 1.0, 0.92, 0.62)
"""A turned limb: its radius from joint to joint."""
_FEWEST, _WANTED, _MOST = 3_000, 5_000, 8_000


def body_of(skeleton: Skeleton) -> tuple[Array, Faces, csr_array]:
    """A watertight body round the bones of a skeleton, which may be in any unit.

    Returns:
        vertices (n, 3) in the skeleton's unit, about 3000 to 8000; faces (m, 3); weights (n, J):
        each vertex follows the joint that its nearest bone turns about.

    Raises:
        InputError: the optional package manifold3d is missing.
    """
    rest = skeleton.rest_positions
    lower, extent = rest.min(axis=0), float(np.linalg.norm(np.ptp(rest, axis=0)))
    scale = _SIZE / extent
    positions = (rest - lower) * scale
    bones = np.array(
        [(parent, joint) for joint, parent in enumerate(skeleton.parents) if parent >= 0]
    )
    radii = bone_radii(positions, bones)
    try:
        vertices, faces = _meshed(positions, bones, radii)
    except ImportError as error:
        raise InputError(
            f"a body for a rig without a mesh needs the extra ({error.name}): "
            "pip install 'bunraku[characters]'"
        ) from None
    owner = bones[_nearest_bone(vertices, positions, bones, radii), 0]
    ones, rows = np.ones(len(vertices)), np.arange(len(vertices))
    weights = coo_array((ones, (rows, owner)), shape=(len(vertices), len(rest)))
    return vertices / scale + lower, faces, csr_array(weights.tocsr())


def bone_radii(positions: Array, bones: Bones) -> Array:
    """The radius (b,) of each bone: of its length, and of how much hangs on it.

    Limbs thin out as branches do: the square root of the length of all that a bone carries bounds
    what its own length asks for, so that long shins stay thin and short spines do not.
    """
    length = np.linalg.norm(positions[bones[:, 1]] - positions[bones[:, 0]], axis=1)
    into = {int(joint): number for number, joint in enumerate(bones[:, 1])}
    carried = length.copy()
    for number in _leaves_first(bones):
        above = into.get(int(bones[number, 0]))
        if above is not None:
            carried[above] += carried[number]
    branch = 0.07 * _SIZE * np.sqrt(carried / length.sum())
    radii: Array = np.sqrt(branch * 0.26 * length)
    return np.clip(radii, 0.006 * _SIZE, 0.055 * _SIZE)


def _leaves_first(bones: Bones) -> list[int]:
    below: dict[int, list[int]] = {}
    for number, (parent, _) in enumerate(bones):
        below.setdefault(int(parent), []).append(number)
    roots = set(bones[:, 0].tolist()) - set(bones[:, 1].tolist())
    order = [number for root in roots for number in below[root]]
    for number in order:
        order.extend(below.get(int(bones[number, 1]), []))
    return order[::-1]


def _solid(positions: Array, bones: Bones, radii: Array) -> Field:
    limbs = []
    for (start, end), radius in zip(bones, radii, strict=True):
        along = np.linspace(0.0, 1.0, len(_PROFILE))[:, None]
        path = positions[start] + along * (positions[end] - positions[start])
        limbs.append(tube(path, radius * np.array(_PROFILE)))
    return smooth_union(0.015 * _SIZE, *limbs)


def _meshed(positions: Array, bones: Bones, radii: Array) -> tuple[Array, Faces]:
    """The body's mesh, its edges chosen so that it has about as many vertices as are wanted."""
    length = np.linalg.norm(positions[bones[:, 1]] - positions[bones[:, 0]], axis=1)
    area = float(np.sum(2.0 * np.pi * radii * length))
    edge = np.sqrt(area / (0.87 * _WANTED))
    for _ in range(3):
        thick = np.maximum(radii, 0.8 * edge)
        air = 2.0 * edge + thick.max()
        sculpture = Sculpture(
            solid=_solid(positions, bones, thick),
            lower=tuple(positions.min(axis=0) - air),
            upper=tuple(positions.max(axis=0) + air),
            edge=edge,
            base="",
            paints=(),
            limbs=(),
        )
        vertices, faces = level_set(sculpture)
        if _FEWEST <= len(vertices) <= _MOST:
            break
        edge *= float(np.sqrt(len(vertices) / _WANTED))
    return relaxed(vertices, faces, sculpture.solid, edge, rounds=4), faces


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
