"""The built-in squid: a floating plush squid with eight tentacles spread towards the camera."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from runtime.characters.builtin.face import Face, paints
from runtime.characters.builtin.sculpture import Array, Limb, Paint, Sculpture
from runtime.characters.builtin.signed_distance import (
    Field,
    curve,
    ellipsoid,
    in_front,
    smooth_union,
    taper,
    tube,
    union,
)

# One side's tentacles, from the topmost down: where each passes, x outwards. The fan is spread in
# the plane that faces the camera, so that the tentacles differ in screen space.
_SIDE = (
    [
        (0.13, 0.66, 0.03),
        (0.36, 0.62, 0.06),
        (0.60, 0.68, 0.04),
        (0.77, 0.84, 0.02),
        (0.76, 0.96, 0.03),
        (0.69, 0.945, 0.05),
    ],
    [
        (0.12, 0.61, -0.03),
        (0.31, 0.47, -0.06),
        (0.55, 0.37, -0.05),
        (0.76, 0.39, -0.02),
        (0.84, 0.50, 0.0),
        (0.79, 0.57, 0.02),
    ],
    [
        (0.09, 0.57, 0.05),
        (0.23, 0.37, 0.06),
        (0.40, 0.22, 0.05),
        (0.58, 0.16, 0.03),
        (0.71, 0.21, 0.03),
        (0.70, 0.29, 0.04),
    ],
    [
        (0.045, 0.57, 0.02),
        (0.085, 0.34, 0.05),
        (0.12, 0.16, 0.08),
        (0.19, 0.055, 0.11),
        (0.31, 0.036, 0.15),
        (0.38, 0.09, 0.17),
    ],
)
_SECTIONS = 25
_THICKNESS = taper([0.080, 0.064, 0.052, 0.043, 0.036, 0.031, 0.031], _SECTIONS)


def _body() -> Field:
    mantle = tube(
        curve([(0, 1.00, 0), (0, 1.18, -0.01), (0.0, 1.38, -0.02), (0.02, 1.56, -0.02)], 30),
        taper([0.205, 0.245, 0.25, 0.225, 0.175, 0.115, 0.06, 0.028], 30),
    )
    head = ellipsoid((0, 0.815, 0.01), (0.262, 0.205, 0.215))
    skirt = ellipsoid((0, 0.63, 0.0), (0.17, 0.12, 0.13))
    fins = [
        ellipsoid(
            (side * 0.19, 1.33, -0.035),
            (0.20, 0.105, 0.055),
            Rotation.from_euler("z", side * 34, degrees=True),
        )
        for side in (1, -1)
    ]
    return smooth_union(0.07, mantle, head, skirt, *fins)


def _suckers(paths: list[Array]) -> Field:
    spots: list[Field] = []
    for path in paths:
        for at in range(5, 22, 3):
            along = path[at + 1] - path[at - 1]
            outward = np.array([along[1], -along[0], 0.0])
            below = outward / np.linalg.norm(outward) * np.sign(path[-2, 0])
            center = path[at] + 0.6 * _THICKNESS[at] * np.add(below, (0, 0, 0.8))
            spots.append(ellipsoid(center, 0.46 * _THICKNESS[at]))
    return union(*spots)


def _freckles() -> Field:
    spots = (
        ((-0.10, 1.20, 0.22), 0.042),
        ((0.02, 1.30, 0.20), 0.032),
        ((0.12, 1.17, 0.21), 0.036),
        ((-0.01, 1.12, 0.25), 0.026),
        ((0.07, 1.05, 0.23), 0.020),
        ((-0.05, 1.40, 0.14), 0.026),
    )
    return union(*(ellipsoid(center, size) for center, size in spots))


def sculpt() -> Sculpture:
    """The squid, 1.59 m tall."""
    right = [curve(path, _SECTIONS) for path in _SIDE]
    paths = [path * [side, 1, 1] for side in (1, -1) for path in right]
    arms = smooth_union(0.035, *(tube(path, _THICKNESS) for path in paths))
    eyes = [ellipsoid((side * 0.112, 0.845, 0.165), (0.098, 0.108, 0.075)) for side in (1, -1)]
    face = Face(
        y=0.845,
        apart=0.112,
        eye=(0.084, 0.094),
        pupil=(0.050, 0.062),
        smile=(0.062, 0.034, 0.725, 0.0095),
        cheek=(0.20, 0.742, 0.05),
    )
    fins = union(*(ellipsoid((s * 0.27, 1.36, -0.04), (0.16, 0.13, 0.1)) for s in (1, -1)))
    layers = (
        Paint(ellipsoid((0, 0.20, 0), (1.3, 0.46, 1.0)), "#ff9a5a", softness=0.5),
        Paint(fins, "#ff9a5a", softness=0.12),
        Paint(_freckles(), "#c93c63", softness=0.014),
        Paint(_suckers(paths), "#ffe3cf", softness=0.014),
        *paints(face, in_front(0.05)),
    )
    limbs = [
        Limb(
            "mantle",
            curve([(0, 0.64, 0), (0, 0.96, 0), (0, 1.26, -0.015), (0.016, 1.52, -0.02)], 8),
        )
    ]
    for number, path in enumerate(paths, start=1):
        nodes = curve(list(path), 10)
        nodes[-1] += 0.25 * (nodes[-2] - nodes[-1])
        limbs.append(Limb(f"tentacle{number}.", nodes, parent="mantle0"))
    return Sculpture(
        smooth_union(0.03, smooth_union(0.07, _body(), arms), *eyes),
        (-0.94, -0.06, -0.32),
        (0.94, 1.68, 0.38),
        0.031,
        "#f2587a",
        layers,
        tuple(limbs),
    )
