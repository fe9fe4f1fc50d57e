"""The blend shapes of the built-in characters: both eyes shut, the mouth opens, the smile widens.

Eyes and mouths are painted on the surface (`runtime.characters.builtin.face`), so a blend shape
slides the surface along itself: vertices near an eye move towards its middle line, and the paint
with them. Rest poses stay as they are meshed.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from runtime.characters.morphs import Expression, Morphs
from solvers.deform.cell_planes import vertex_normals
from solvers.deform.morph_targets import MorphTargets

Array = NDArray[np.float64]

NAMES = ("blinkLeft", "blinkRight", "aa", "happy")
SHUT = 0.9  # of an eye's height that a blink takes away
STEEPEST = 1.0  # forward or back, over the slide seen from the front
STILL = 1e-5  # [m] smaller moves are left out
NEIGHBOURS = 4


@dataclass(frozen=True, slots=True)
class FacePlaces:
    """Where a character's face is on the stage, seen from the front [m].

    Attributes:
        eye: x and y of the left eye's centre, its half-width and half-height; the right eye is
            opposite.
        mouth: half-width, height of the corners, depth of the curve in the middle, half-thickness.
        opens: how far the lower lip goes down, and the upper lip up.
        around: of an eye's half-axes, how far around it the skin is drawn along.
        reach: how far above and below the lips the skin is drawn along.
        front: least z of the face.
    """

    eye: tuple[float, float, float, float]
    mouth: tuple[float, float, float, float]
    opens: tuple[float, float]
    around: float
    reach: float
    front: float


FACES = {
    "squid": FacePlaces(
        (0.112, 0.844, 0.088, 0.098),
        (0.062, 0.724, 0.034, 0.0095),
        (0.045, 0.010),
        1.25,
        0.10,
        0.05,
    ),
    "cactus": FacePlaces(
        (0.085, 1.075, 0.034, 0.044),
        (0.048, 1.012, 0.030, 0.0085),
        (0.040, 0.006),
        1.6,
        0.085,
        0.05,
    ),
    "trex": FacePlaces(
        (0.122, 1.411, 0.062, 0.066), (0.20, 1.191, 0.105, 0.028), (0.065, 0.010), 1.3, 0.15, 0.10
    ),
    "paper": FacePlaces(
        (0.135, 0.880, 0.050, 0.072), (0.150, 0.745, 0.105, 0.017), (0.085, 0.010), 1.6, 0.18, -1.0
    ),
    "mannequin": FacePlaces(
        (0.043, 1.560, 0.016, 0.021), (0.032, 1.503, 0.018, 0.006), (0.022, 0.004), 1.8, 0.048, 0.03
    ),
}
"""The numbers of the sculptors, less what stood below the ground before a mesh was stored."""


def builtin_morphs(name: str, vertices: Array, faces: NDArray[np.int64]) -> Morphs:
    """Return the blend shapes of a built-in character.

    Args:
        name: of the character.
        vertices: (N, 3) [m] of its mesh.
        faces: (F, 3) of it.
    """
    face = FACES[name]
    moves = [_blink(face, 1.0), _blink(face, -1.0), _open_mouth(face), _smile(face)]
    sides = np.sign(vertex_normals(vertices, faces)[:, 2])
    targets = [_along_surface(vertices, sides, face, move) for move in moves]
    both = Expression("blink", ((0, 1.0), (1, 1.0)))
    return Morphs.of(MorphTargets.of(targets), NAMES, (both,))


Slide = Callable[[Array, Array], tuple[Array, Array]]
"""Where points (n,) x and (n,) y, seen from the front, slide to."""


def _blink(face: FacePlaces, side: float) -> Slide:
    x0, y0, width, height = face.eye

    def slide(x: Array, y: Array) -> tuple[Array, Array]:
        far = np.hypot((x - side * x0) / width, (y - y0) / height)
        return x, y - SHUT * (y - y0) * _fading((far - 1.0) / (face.around - 1.0))

    return slide


def _open_mouth(face: FacePlaces) -> Slide:
    down, up = face.opens

    def slide(x: Array, y: Array) -> tuple[Array, Array]:
        across, above, thick = _from_mouth(face, x, y)
        # Inside the line it is drawn apart in proportion; beyond, the skin follows less and less.
        apart = np.clip(above / thick, -1.0, 1.0) * _fading((np.abs(above) - thick) / face.reach)
        return x, y + np.where(apart < 0.0, down, up) * apart * _fading(across)

    return slide


def _smile(face: FacePlaces) -> Slide:
    width, _, depth, _ = face.mouth

    def slide(x: Array, y: Array) -> tuple[Array, Array]:
        _, above, thick = _from_mouth(face, x, y)
        near = _fading((np.abs(above) - thick) / face.reach)
        near = near * _fading((np.abs(x) / width - 1.0) / 0.7)
        corner = np.clip(np.abs(x) / width, 0.0, 1.3)
        rise = 0.55 * depth * (corner**2 - 0.35)
        return x * (1.0 + 0.22 * near), y + rise * near

    return slide


def _from_mouth(face: FacePlaces, x: Array, y: Array) -> tuple[Array, Array, Array]:
    """|x| over the mouth's half-width, y above the middle of its line, and half the thickness."""
    width, corners, depth, thickness = face.mouth
    across = np.abs(x) / width
    line = corners - depth * (1.0 - np.minimum(across, 1.0) ** 2)
    return across, y - line, np.full_like(x, thickness)


def _fading(way: Array) -> Array:
    """1 up to 0, 0 from 1 on, smooth between."""
    t = np.clip(way, 0.0, 1.0)
    faded: Array = 1.0 - t * t * (3.0 - 2.0 * t)
    return faded


def _along_surface(
    vertices: Array, sides: Array, face: FacePlaces, slide: Slide
) -> tuple[NDArray[np.int64], Array]:
    """The moved vertices (e,) and their deltas (e, 3); they stay on their side of the surface.

    Args:
        vertices: (N, 3) [m].
        sides: (N,) 1 where the surface looks forward, -1 where it looks back.
        face: where it is.
        slide: of the points seen from the front.
    """
    found = []
    for side in (1.0, -1.0):
        own = np.flatnonzero((vertices[:, 2] > face.front) & (sides == side))
        points = vertices[own]
        x, y = slide(points[:, 0], points[:, 1])
        flat = np.column_stack([x, y]) - points[:, :2]
        length = np.hypot(*flat.T)
        moved = length > STILL
        far, near = cKDTree(points[:, :2]).query(np.column_stack([x, y])[moved], k=NEIGHBOURS)
        weights = 1.0 / (far**2 + 1e-10)
        z = (weights * points[near, 2]).sum(axis=1) / weights.sum(axis=1) - points[moved, 2]
        limit = STEEPEST * length[moved]
        found.append((own[moved], np.column_stack([flat[moved], np.clip(z, -limit, limit)])))
    return np.concatenate([v for v, _ in found]), np.concatenate([d for _, d in found])
