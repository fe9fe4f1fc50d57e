"""The built-in mannequin: an artist's wooden figure with its arms away from the body."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from runtime.characters.builtin.face import Face, paints
from runtime.characters.builtin.sculpture import Array, Limb, Paint, Sculpture
from runtime.characters.builtin.signed_distance import (
    Field,
    ellipsoid,
    grown,
    in_front,
    smooth_union,
    taper,
    tube,
)

_SHOULDER, _ELBOW = np.array([0.215, 1.285, 0.0]), np.array([0.395, 1.075, 0.0])
_WRIST, _FINGERS = np.array([0.56, 0.88, 0.035]), np.array([0.635, 0.775, 0.055])
_HIP, _KNEE = np.array([0.105, 0.80, 0.0]), np.array([0.145, 0.455, 0.015])
_ANKLE, _TOES = np.array([0.175, 0.105, 0.0]), np.array([0.20, 0.042, 0.15])


def _between(start: Array, end: Array, radii: list[float], margin: float = 0.20) -> Field:
    path = np.linspace(start + margin * (end - start), end - margin * (end - start), 12)
    return tube(path, taper(radii, 12))


def _limbs(side: int) -> tuple[list[Field], list[Field]]:
    flip = np.array([side, 1, 1])
    shoulder, elbow, wrist, fingers = (p * flip for p in (_SHOULDER, _ELBOW, _WRIST, _FINGERS))
    hip, knee, ankle, toes = (p * flip for p in (_HIP, _KNEE, _ANKLE, _TOES))
    palm = Rotation.align_vectors([wrist - fingers], [[0, 1, 0]])[0]
    wood = [
        _between(shoulder, elbow, [0.050, 0.062, 0.054, 0.043]),
        _between(elbow, wrist, [0.043, 0.051, 0.041, 0.032]),
        ellipsoid(0.42 * wrist + 0.58 * fingers, (0.046, 0.082, 0.030), palm),
        tube(
            [wrist + flip * [0.012, -0.035, 0.03], wrist + flip * [-0.005, -0.083, 0.067]],
            [0.02, 0.017],
        ),
        _between(hip, knee, [0.072, 0.088, 0.074, 0.053]),
        _between(knee, ankle, [0.052, 0.066, 0.053, 0.040]),
        ellipsoid(
            0.45 * ankle + 0.55 * toes + [0, -0.008, -0.005],
            (0.056, 0.048, 0.125),
            Rotation.from_euler("y", side * 12, degrees=True),
        ),
    ]
    balls = [
        ellipsoid(at, size)
        for at, size in (
            (shoulder, 0.058),
            (elbow, 0.046),
            (wrist, 0.035),
            (hip, 0.075),
            (knee, 0.056),
            (ankle, 0.043),
        )
    ]
    return wood, balls


def _grain(points: Array) -> Array:
    rings = np.sin(
        85.0
        * (points[:, 1] + 0.05 * np.sin(9.0 * points[:, 0]) + 0.03 * np.sin(14.0 * points[:, 2]))
    )
    return 0.35 - rings


def sculpt() -> Sculpture:
    """The mannequin, 1.78 m tall with its beret, arms 45 degrees away from the body."""
    wood: list[Field] = [
        ellipsoid((0, 1.565, 0.012), (0.112, 0.152, 0.125)),
        tube([(0, 1.36, -0.005), (0, 1.44, 0)], [0.05, 0.046]),
        tube([(0, 1.29, 0), (0, 1.22, 0.0), (0, 1.14, 0)], [0.112, 0.128, 0.104]),
        ellipsoid((0, 1.275, 0.0), (0.185, 0.105, 0.098)),
        ellipsoid((0, 0.855, 0.0), (0.165, 0.115, 0.115)),
    ]
    balls: list[Field] = [
        ellipsoid((0, 1.02, 0), (0.092, 0.088, 0.084)),
        ellipsoid((0, 1.40, 0), (0.058, 0.05, 0.058)),
    ]
    for side in (1, -1):
        more_wood, more_balls = _limbs(side)
        wood += more_wood
        balls += more_balls
    tilt = Rotation.from_euler("xz", [-8, -15], degrees=True)
    beret = [
        ellipsoid((0.028, 1.688, -0.008), (0.152, 0.048, 0.148), tilt),
        tube([(0.035, 1.715, -0.01), (0.048, 1.765, -0.014)], [0.020, 0.015]),
    ]
    face = Face(
        y=1.575,
        apart=0.043,
        eye=(0.016, 0.021),
        pupil=(0.016, 0.021),
        smile=(0.032, 0.018, 1.518, 0.0060),
        cheek=(0.066, 1.526, 0.02),
    )
    layers = (
        Paint(_grain, "#d29a5e", softness=1.2, strength=0.25),
        Paint(grown(0.006, *balls), "#a5673a", softness=0.010),
        Paint(grown(0.006, *beret), "#d8373f", softness=0.010),
        *paints(face, in_front(0.03), white=None),
    )
    return Sculpture(
        smooth_union(0.014, *wood, *balls, *beret),
        (-0.78, -0.05, -0.24),
        (0.78, 1.84, 0.32),
        0.024,
        "#ecc08a",
        layers,
        _skeleton(),
    )


def _skeleton() -> tuple[Limb, ...]:
    limbs = [
        Limb("spine", np.array([(0, y, 0) for y in (0.87, 0.96, 1.05, 1.16, 1.27)])),
        Limb(
            "head",
            np.array(
                [(0, 1.345, 0), (0, 1.41, 0), (0, 1.50, 0.01), (0, 1.60, 0.012), (0, 1.68, 0.012)]
            ),
            "spine4",
        ),
    ]
    for side, name in ((1, "left"), (-1, "right")):
        flip = np.array([side, 1, 1])
        palm = 0.2 * _WRIST + 0.8 * _FINGERS
        arm = np.vstack(
            [np.linspace(_SHOULDER, _ELBOW, 4), np.linspace(_ELBOW, _WRIST, 4)[1:], palm]
        )
        leg = np.vstack(
            [
                np.linspace(_HIP, _KNEE, 4),
                np.linspace(_KNEE, _ANKLE, 4)[1:],
                0.4 * _ANKLE + 0.6 * _TOES,
            ]
        )
        limbs.append(Limb(f"{name}_arm", arm * flip, "spine4"))
        limbs.append(Limb(f"{name}_leg", leg * flip, "spine0"))
    return tuple(limbs)
