"""Paint the faces of the built-in characters: eyes, pupils and a smile, seen from the front."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from runtime.characters.builtin.sculpture import Paint
from runtime.characters.builtin.signed_distance import (
    Field,
    curve,
    ellipsoid,
    tube,
    union,
)


@dataclass(frozen=True, slots=True)
class Face:
    """The position and size of a face, seen from the front [m].

    Attributes:
        y: height of the eyes' centres.
        apart: from the middle to an eye's centre.
        eye: half-width and half-height of an eye.
        pupil: half-width and half-height of a pupil.
        smile: half-width, depth of its curve, height of its corners, half-thickness.
        cheek: x, y and radius.
    """

    y: float
    apart: float
    eye: tuple[float, float]
    pupil: tuple[float, float]
    smile: tuple[float, float, float, float]
    cheek: tuple[float, float, float]


def both(x: float, y: float, radii: tuple[float, float]) -> Field:
    """Two ellipses, mirror images of one another."""
    return union(*(ellipsoid((side * x, y, 0.0), (*radii, radii[0])) for side in (1, -1)))


def paints(
    face: Face,
    decal: Callable[[Field], Field],
    *,
    white: str | None = "#fffaf0",
    dark: str = "#1c1226",
) -> tuple[Paint, ...]:
    """The layers of the face, each region put on the surface by `decal`.

    Without `white` the pupils stand alone, like beads.
    """
    width, depth, height, thickness = face.smile
    mouth = curve([(-width, height, 0), (0, height - depth, 0), (width, height, 0)], 15)
    glint = 0.42 * face.pupil[0]
    lift = 0.42 * face.pupil[1]
    inward = 0.10 * face.eye[0] if white else 0.0
    glints = union(
        *(
            ellipsoid((s * (face.apart - inward) + 0.3 * face.pupil[0], face.y + lift, 0), glint)
            for s in (1, -1)
        )
    )
    cheeks = both(face.cheek[0], face.cheek[1], (face.cheek[2], 0.75 * face.cheek[2]))
    layers = [
        Paint(decal(cheeks), "#ff5d7d", softness=0.8 * face.cheek[2], strength=0.7),
        Paint(decal(tube(mouth, thickness)), dark),
    ]
    if white:
        layers.append(Paint(decal(both(face.apart, face.y, face.eye)), white))
    layers.append(Paint(decal(both(face.apart - inward, face.y, face.pupil)), dark))
    layers.append(Paint(decal(glints), "#ffffff"))
    return tuple(layers)
