"""A part from a stroke: a round tube along what was drawn, with its polyline as its skeleton."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.sparse import coo_array, csr_array

from devices.errors import InputError
from devices.skeleton import Skeleton
from runtime.characters.builtin.meshing import level_set, relaxed
from runtime.characters.builtin.sculpture import Sculpture
from runtime.characters.builtin.signed_distance import tube
from runtime.characters.character import Character, Material, Surface

Array = NDArray[np.float64]

_EDGE = 0.45  # of the middle radius: how long the mesh's edges are, about
_MOST_SAMPLES = 1_000_000  # places at which the solid is asked
_BONE = 4.0  # middle radii: how long a bone is, about
_MOST_BONES = 24
_STEPS = 128  # along a stroke
_SMOOTHINGS = 3  # of a hand that trembles


def radii_by_speed(points: ArrayLike, times: ArrayLike, thin: float, thick: float) -> Array:
    """Return the radius (n,) at each point of a stroke: thick where the hand was slow.

    A hand at its usual speed draws half-way between; twice as fast and faster, thin.

    Args:
        points: (n, 3) [m].
        times: (n,) [s] ascending, when each was drawn.
        thin, thick: [m] of the radii.

    Raises:
        InputError: times that do not ascend, or other radii than 0 < thin <= thick.
    """
    places, moments = np.asarray(points, dtype=np.float64), np.asarray(times, dtype=np.float64)
    if moments.shape != (len(places),) or not (np.diff(moments) > 0.0).all():
        raise InputError("a stroke needs a time for each point, and they are to ascend")
    if not 0.0 < thin <= thick < np.inf:
        raise InputError(f"a stroke's radii are to be 0 < thin <= thick, got {thin:g}, {thick:g}")
    if len(places) < 2:
        return np.full(len(places), thick)
    steps = np.linalg.norm(np.diff(places, axis=0), axis=1) / np.diff(moments)
    speed = np.interp(moments, 0.5 * (moments[1:] + moments[:-1]), steps)
    usual = float(np.median(speed))
    share = np.clip(0.5 * speed / usual, 0.0, 1.0) if usual > 0.0 else np.zeros(len(speed))
    radii: Array = thick + share * (thin - thick)
    return radii


def part_of_stroke(
    name: str, points: ArrayLike, radii: ArrayLike, color: tuple[float, float, float]
) -> Character:
    """Make a part from a stroke: watertight, rounded at both ends, evenly meshed.

         . - ~ - .               ( ==o======o======o== )
        stroke         ->          nodes along its middle

    A dot gives a ball. Where the stroke crosses itself, the tube grows together.

    Args:
        name: of the part.
        points: (n, 3) [m] of the stroke.
        radii: (n,) [m] at its points, or one number.
        color: linear red, green, blue in [0, 1].

    Raises:
        InputError: no points, values that are not finite, radii that are not positive, a stroke
            that is too long for its radii, or the extra "characters" is missing.

    Source: Borosan et al. 2012, RigMesh: a stroke becomes a generalised cylinder with a skeleton.
    """
    path, sizes = _checked(points, radii)
    scale = float(np.ptp(path, axis=0).max() + 2.0 * sizes.max())
    way, thick = _even(path, sizes)
    edge = _EDGE * float(np.median(thick)) / scale
    lower, upper = way.min(axis=0) - thick.max(), way.max(axis=0) + thick.max()
    low, high = lower / scale - 2.0 * edge, upper / scale + 2.0 * edge
    if 2.0 * np.prod((high - low) / edge) > _MOST_SAMPLES:
        raise InputError(f"the stroke of {name} is too long for so small a radius; draw it thicker")
    field = tube(way / scale, thick / scale)
    a, b = (tuple(corner.tolist()) for corner in (low, high))
    sculpture = Sculpture(field, (a[0], a[1], a[2]), (b[0], b[1], b[2]), edge, "#ffffff", (), ())
    try:
        vertices, faces = level_set(sculpture)
    except ImportError as error:
        raise InputError(
            f"a part from a stroke needs the extra ({error.name}): "
            "pip install 'bunraku[characters]'"
        ) from None
    vertices = scale * relaxed(vertices, faces, field, edge, rounds=6)
    skeleton = _skeleton(name, way, float(np.median(thick)))
    look = np.append(np.asarray(color, dtype=np.float32), np.float32(1.0))
    return Character(
        name=name,
        vertices=vertices,
        faces=faces,
        skeleton=skeleton,
        weights=_weights(vertices, skeleton.rest_positions),
        surface=Surface(
            np.arange(len(vertices)),
            faces.astype(np.int32),
            np.tile(look, (len(vertices), 1)),
            None,
            (Material(np.ones(4, np.float32)),),
            np.zeros(len(faces), np.int64),
        ),
        file_to_stage=np.eye(4),
    )


def _checked(points: ArrayLike, radii: ArrayLike) -> tuple[Array, Array]:
    path = np.asarray(points, dtype=np.float64)
    if path.ndim != 2 or path.shape[1] != 3 or not len(path) or not np.isfinite(path).all():
        raise InputError(f"a stroke has points (x, y, z), got the shape {path.shape}")
    sizes = np.asarray(radii, dtype=np.float64)
    if sizes.ndim > 1 or (sizes.ndim == 1 and len(sizes) != len(path)):
        raise InputError(f"a stroke of {len(path)} points has {sizes.size} radii")
    sizes = np.broadcast_to(sizes, len(path))
    if not (np.isfinite(sizes).all() and (sizes > 0.0).all()):
        raise InputError("a stroke's radii are to be positive")
    return path, sizes


def _even(path: Array, sizes: Array) -> tuple[Array, Array]:
    """The stroke at even steps and without trembling; a dot as a stroke that is all but one."""
    along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(path, axis=0), axis=1))])
    if along[-1] < 1e-3 * sizes.min():
        return path[0] + [[0.0, -1e-3 * sizes[0], 0.0], [0.0, 1e-3 * sizes[0], 0.0]], sizes[[0, 0]]
    at = np.linspace(0.0, along[-1], _STEPS)
    way = np.stack([np.interp(at, along, path[:, k]) for k in range(3)], axis=1)
    thick = np.interp(at, along, sizes)
    for _ in range(_SMOOTHINGS):
        way[1:-1] = 0.25 * (way[:-2] + 2.0 * way[1:-1] + way[2:])
        thick[1:-1] = 0.25 * (thick[:-2] + 2.0 * thick[1:-1] + thick[2:])
    return way, thick


def _skeleton(name: str, way: Array, radius: float) -> Skeleton:
    along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(way, axis=0), axis=1))])
    bones = int(np.clip(round(along[-1] / (_BONE * radius)), 1, _MOST_BONES))
    at = np.linspace(0.0, along[-1], bones + 1)
    nodes = np.stack([np.interp(at, along, way[:, k]) for k in range(3)], axis=1)
    names = tuple(f"{name}{number}" for number in range(len(nodes)))
    return Skeleton(names, np.arange(len(nodes)) - 1, nodes)


def _weights(vertices: Array, nodes: Array) -> csr_array:
    """Skin (N, K): the bone that starts at each node, blended over half of it at either end."""
    bones = len(nodes) - 1
    nearest, place = np.full(len(vertices), np.inf), np.zeros(len(vertices))
    for bone in range(bones):
        step = nodes[bone + 1] - nodes[bone]
        share = np.clip((vertices - nodes[bone]) @ step / (step @ step), 0.0, 1.0)
        gap = np.linalg.norm(vertices - nodes[bone] - share[:, None] * step, axis=1)
        place = np.where(gap < nearest, bone + share, place)
        nearest = np.minimum(nearest, gap)
    centred = np.clip(place - 0.5, 0.0, bones - 1.0)
    first = np.minimum(centred.astype(np.int64), max(bones - 2, 0))
    second = np.minimum(first + 1, bones - 1)
    share = centred - first
    rows = np.arange(len(vertices))
    entries = np.concatenate([1.0 - share, share])
    places = np.concatenate([rows, rows]), np.concatenate([first, second])
    return csr_array(coo_array((entries, places), shape=(len(vertices), len(nodes))))
