"""The built-in T-Rex: a large head and tail, and very small arms."""

from __future__ import annotations

import numpy as np

from runtime.characters.builtin.face import both
from runtime.characters.builtin.sculpture import Limb, Paint, Sculpture
from runtime.characters.builtin.signed_distance import (
    Field,
    curve,
    ellipsoid,
    grown,
    in_front,
    smooth_difference,
    smooth_union,
    taper,
    tube,
    union,
)

# The tail sweeps out to one side, so that it is seen from the front.
_TAIL = [
    (0.0, 0.50, -0.12),
    (-0.20, 0.36, -0.34),
    (-0.44, 0.30, -0.42),
    (-0.66, 0.38, -0.38),
    (-0.80, 0.56, -0.30),
]
_SPINE = [(0.0, 0.50, -0.02), (0.0, 0.70, 0.0), (0.0, 0.90, 0.03), (0.0, 1.08, 0.06)]
_LEG = [(0.17, 0.48, -0.03), (0.245, 0.32, 0.04), (0.245, 0.16, -0.01), (0.25, 0.06, 0.02)]
_ARM = [(0.15, 0.84, 0.12), (0.28, 0.80, 0.20), (0.365, 0.735, 0.26), (0.42, 0.725, 0.30)]
_HEAD = (0.0, 1.22, 0.10)


def _body() -> Field:
    torso = tube(curve(_SPINE, 20), taper([0.245, 0.27, 0.235, 0.175, 0.16], 20))
    belly = ellipsoid((0, 0.60, 0.06), (0.27, 0.29, 0.25))
    tail = tube(curve(_TAIL, 30), taper([0.20, 0.155, 0.105, 0.065, 0.032], 30))
    return smooth_union(0.12, torso, belly, tail)


def _limbs() -> Field:
    parts: list[Field] = []
    for side in (1, -1):
        flip = np.array([side, 1, 1])
        parts.append(tube(curve(_LEG * flip, 20), taper([0.165, 0.145, 0.095, 0.085], 20)))
        parts.append(ellipsoid(np.array([0.265, 0.058, 0.09]) * flip, (0.115, 0.066, 0.165)))
        for toe in (-0.068, 0.0, 0.068):
            parts.append(
                ellipsoid(np.array([0.268 + toe, 0.038, 0.235]) * flip, (0.036, 0.038, 0.05))
            )
        parts.append(tube(curve(_ARM * flip, 14), taper([0.062, 0.05, 0.046, 0.042], 14)))
        for claw in (-1, 1):
            tip = np.array([0.468, 0.725 + 0.044 * claw, 0.332])
            parts.append(tube([np.array(_ARM[-1]) * flip, tip * flip], [0.038, 0.027]))
    return smooth_union(0.035, *parts)


def _head() -> Field:
    skull = ellipsoid(_HEAD, (0.245, 0.225, 0.235))
    snout = ellipsoid((0, 1.155, 0.30), (0.205, 0.135, 0.20))
    jaw = ellipsoid((0, 1.045, 0.25), (0.175, 0.085, 0.20))
    brows = [ellipsoid((side * 0.125, 1.375, 0.16), (0.092, 0.092, 0.085)) for side in (1, -1)]
    return smooth_union(0.05, smooth_union(0.06, skull, snout, jaw), *brows)


def _grin() -> Field:
    return tube(
        curve(
            [
                (-0.20, 1.165, 0.24),
                (-0.16, 1.095, 0.38),
                (0, 1.062, 0.47),
                (0.16, 1.095, 0.38),
                (0.20, 1.165, 0.24),
            ],
            25,
        ),
        taper([0.008, 0.02, 0.028, 0.02, 0.008], 25),
    )


def _teeth() -> list[Field]:
    gum = curve(
        [
            (-0.185, 1.145, 0.29),
            (-0.15, 1.105, 0.40),
            (0, 1.083, 0.475),
            (0.15, 1.105, 0.40),
            (0.185, 1.145, 0.29),
        ],
        9,
    )
    teeth: list[Field] = []
    for at in gum[1:-1]:
        inward = np.array([-0.10 * at[0], 0.0, -0.012])
        teeth.append(
            tube([at + inward + [0, 0.015, 0], at + inward + [0, -0.040, 0.004]], [0.026, 0.008])
        )
    return teeth


def _crest() -> list[Field]:
    plates: list[Field] = []
    ridge = np.vstack(
        [
            [
                (0, 1.455, 0.02),
                (0, 1.36, -0.15),
                (0, 1.17, -0.185),
                (0, 0.98, -0.20),
                (0, 0.79, -0.255),
                (0, 0.61, -0.31),
            ],
            np.add(curve(_TAIL, 8)[3:7], [(0, h, 0) for h in (0.135, 0.115, 0.093, 0.073)]),
        ]
    )
    for at, size in zip(
        ridge, (0.06, 0.07, 0.075, 0.08, 0.08, 0.07, 0.06, 0.055, 0.05, 0.042), strict=True
    ):
        plates.append(ellipsoid(at, (0.036, size, size)))
    return plates


def _stripes() -> Field:
    path = curve(_TAIL, 15)
    bands = [ellipsoid(np.add(at, (0, 0.05, -0.03)), (0.028, 0.13, 0.13)) for at in path[5:14:3]]
    back = [
        ellipsoid((side * 0.25, y, -0.10), (0.15, 0.03, 0.16))
        for side in (1, -1)
        for y in (0.66, 0.79, 0.92)
    ]
    return union(*bands, *back)


def sculpt() -> Sculpture:
    """The T-Rex, 1.5 m tall, standing upright."""
    teeth, crest = _teeth(), _crest()
    skin = smooth_union(0.05, smooth_union(0.05, _body(), _limbs()), _head())
    skin = smooth_union(0.02, skin, *crest)
    solid = smooth_union(0.016, smooth_difference(0.025, skin, _grin()), *teeth)
    eye, pupil = both(0.122, 1.385, (0.062, 0.066)), both(0.115, 1.382, (0.038, 0.046))
    glint = union(*(ellipsoid((side * 0.115 + 0.013, 1.401, 0), 0.0165) for side in (1, -1)))
    nostrils = both(0.062, 1.215, (0.016, 0.012))
    claws = [
        ellipsoid((s * (0.268 + toe), 0.03, 0.277), 0.03)
        for s in (1, -1)
        for toe in (-0.068, 0.0, 0.068)
    ]
    nails = [
        ellipsoid((s * 0.480, 0.725 + 0.052 * c, 0.340), 0.030) for s in (1, -1) for c in (1, -1)
    ]
    belly = ellipsoid((0, 0.62, 0.30), (0.185, 0.33, 0.22))
    layers = (
        Paint(_stripes(), "#2b8a5f", softness=0.03),
        Paint(belly, "#fff0b8", softness=0.05),
        Paint(ellipsoid((0, 1.0, 0.40), (0.22, 0.095, 0.26)), "#fff0b8", softness=0.03),
        Paint(both(0.185, 1.235, (0.05, 0.036)), "#ff8b7a", softness=0.04, strength=0.6),
        Paint(grown(0.006, _grin()), "#8c2440"),
        Paint(grown(0.005, *teeth), "#fffdf2", softness=0.004),
        Paint(grown(0.006, *crest), "#ff9d3c", softness=0.014),
        Paint(union(*claws, *nails), "#fff6dd", softness=0.012),
        Paint(in_front(0.3)(nostrils), "#2a5c40", softness=0.01),
        Paint(in_front(0.02)(eye), "#fffaf0"),
        Paint(in_front(0.02)(pupil), "#1c1226"),
        Paint(in_front(0.02)(glint), "#ffffff"),
    )
    return Sculpture(
        solid,
        (-0.92, -0.06, -0.62),
        (0.60, 1.60, 0.62),
        0.0365,
        "#5fc46a",
        layers,
        _skeleton(),
    )


def _skeleton() -> tuple[Limb, ...]:
    spine = curve(_SPINE, 5)
    nape = [spine[-1], _HEAD, (0, 1.20, 0.24), (0, 1.17, 0.40)]
    limbs = [
        Limb("spine", spine[:4]),
        Limb("head", curve(nape, 5), "spine3"),
        Limb("tail", curve(_TAIL, 9)[:-1], "spine0"),
    ]
    for side, name in ((1, "left"), (-1, "right")):
        flip = np.array([side, 1, 1])
        leg = curve([*_LEG, (0.262, 0.05, 0.10)], 6) * flip
        arm = curve(_ARM, 5) * flip
        limbs += [Limb(f"{name}_leg", leg, "spine0"), Limb(f"{name}_arm", arm, "spine3")]
    return tuple(limbs)
