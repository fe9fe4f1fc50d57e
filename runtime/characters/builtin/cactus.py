"""The built-in cactus: a saguaro in a flower pot."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from runtime.characters.builtin.face import Face, paints
from runtime.characters.builtin.sculpture import Array, Limb, Paint, Sculpture
from runtime.characters.builtin.signed_distance import (
    Field,
    curve,
    displaced,
    ellipsoid,
    grown,
    in_front,
    lathe,
    smooth_difference,
    smooth_union,
    tube,
    union,
)

_RIBS = 16
_TOP = 1.30
_ARMS = {
    "left": [
        (0.0, 0.70, 0.0),
        (0.24, 0.70, 0.0),
        (0.37, 0.73, 0.01),
        (0.435, 0.86, 0.02),
        (0.45, 1.10, 0.02),
    ],
    "right": [
        (0.0, 0.86, 0.0),
        (-0.22, 0.86, 0.0),
        (-0.335, 0.885, 0.01),
        (-0.395, 1.00, 0.02),
        (-0.41, 1.19, 0.02),
    ],
}


def _ribbed_trunk() -> Field:
    def ridges(points: Array) -> Array:
        radius = np.hypot(points[:, 0], points[:, 2])
        angle = np.arctan2(points[:, 0], points[:, 2])
        # The ribs end where the face begins, and at the top, where the angle has no meaning.
        smooth = np.exp(-(((points[:, 1] - 1.05) / 0.17) ** 2 + (angle / 0.95) ** 2))
        height: Array = (
            0.011
            * np.cos(_RIBS * angle)
            * (1.0 - smooth)
            * np.clip((radius - 0.04) / 0.12, 0.0, 1.0)
        )
        return height

    trunk = tube([(0, 0.30, 0), (0, 0.70, 0), (0, _TOP - 0.225, 0)], [0.20, 0.225, 0.225])
    return displaced(trunk, ridges)


def _pot() -> Field:
    wall = lathe([(0, 0.02), (0.235, 0.02), (0.305, 0.33), (0, 0.33)], 0.02)
    rim = lathe([(0, 0.335), (0.325, 0.335), (0.335, 0.42), (0, 0.42)], 0.03)
    hollow = lathe([(0, 0.425), (0.265, 0.425), (0.275, 0.60), (0, 0.60)], 0.01)
    return smooth_difference(0.02, smooth_union(0.015, wall, rim), hollow)


def _flower() -> tuple[Field, Field, Field]:
    turn = Rotation.from_euler("xz", [28, -24], degrees=True)
    seat = np.array([0.075, _TOP + 0.005, 0.085])
    petals = []
    for angle in np.arange(6) * (2.0 * np.pi / 6):
        out = np.array([np.sin(angle), 0.35, np.cos(angle)])
        lean = turn * Rotation.from_euler("y", angle) * Rotation.from_euler("x", -19, degrees=True)
        petals.append(ellipsoid(seat + turn.apply(out * 0.078), (0.046, 0.027, 0.066), lean))
    heart = ellipsoid(seat + turn.apply([0, 0.036, 0]), (0.045, 0.036, 0.045), turn)
    stalk = tube([(0.05, _TOP - 0.06, 0.05), np.add(seat, (0, 0.01, 0))], [0.05, 0.04])
    return smooth_union(0.012, *petals), heart, stalk


def _spines() -> Field:
    dots: list[Field] = []
    for rib in range(_RIBS):
        angle = 2.0 * np.pi * rib / _RIBS
        for row in range(9):
            height = 0.47 + 0.095 * (row + 0.5 * (rib % 2))
            if height > 1.2 or (abs((angle + np.pi) % (2 * np.pi) - np.pi) < 1.0 and height > 0.8):
                continue
            direction = np.array([np.sin(angle), 0.0, np.cos(angle)])
            dots.append(ellipsoid(0.232 * direction + [0, height, 0], 0.013))
    for path in _ARMS.values():
        for at in curve(path, 12)[5:]:
            dots.append(ellipsoid(np.add(at, (0, 0, 0.095)), (0.013, 0.013, 0.03)))
            dots.extend(
                ellipsoid(np.add(at, (side * 0.07, 0.035, 0.07)), 0.015) for side in (1, -1)
            )
    return union(*dots)


def _zigzag() -> Field:
    def band(points: Array) -> Array:
        angle = np.arctan2(points[:, 0], points[:, 2])
        wave = 0.03 * (2.0 / np.pi) * np.arcsin(np.cos(10.0 * angle))
        inside: Array = np.abs(points[:, 1] - 0.185 - wave) - 0.021
        return inside

    return band


def sculpt() -> Sculpture:
    """The cactus, 1.4 m tall with its flower."""
    petals, heart, stalk = _flower()
    arms = [
        tube(curve(path, 25), [0.105] * 20 + [0.104, 0.102, 0.1, 0.098, 0.096])
        for path in _ARMS.values()
    ]
    plant = smooth_union(0.02, smooth_union(0.06, _ribbed_trunk(), *arms), stalk)
    solid = smooth_union(0.02, smooth_union(0.015, plant, petals, heart), _pot())
    face = Face(
        y=1.075,
        apart=0.085,
        eye=(0.034, 0.044),
        pupil=(0.034, 0.044),
        smile=(0.048, 0.030, 1.012, 0.0085),
        cheek=(0.138, 1.015, 0.036),
    )
    pot = lathe(
        [
            (0, 0.0),
            (0.26, 0.0),
            (0.345, 0.31),
            (0.375, 0.31),
            (0.375, 0.47),
            (0.275, 0.47),
            (0.275, 0.40),
            (0, 0.40),
        ],
        0,
    )
    soil = lathe([(0, 0.38), (0.28, 0.38), (0.28, 0.43), (0, 0.43)], 0)
    layers = (
        Paint(ellipsoid((0, 0.55, 0), (1.0, 0.5, 1.0)), "#2f9e5b", softness=0.5),
        Paint(_spines(), "#f6f3c8", softness=0.012),
        Paint(pot, "#d9693f", softness=0.008),
        Paint(_zigzag(), "#ffe0b5", softness=0.008),
        Paint(soil, "#5a3a2c", softness=0.02),
        Paint(grown(0.008, petals, stalk), "#ff5fa2", softness=0.012),
        Paint(grown(0.004, heart), "#ffd23f", softness=0.012),
        *paints(face, in_front(0.05), white=None),
    )
    limbs = [
        Limb("trunk", np.array([(0, y, 0) for y in (0.70, 0.78, 0.86)])),
        Limb("base", np.array([(0, y, 0) for y in (0.56, 0.42, 0.27, 0.12)]), "trunk0"),
        Limb("crown", np.array([(0, y, 0) for y in (0.97, 1.08, 1.20)]), "trunk2"),
        Limb("left", curve(_ARMS["left"], 9)[1:], "trunk0"),
        Limb("right", curve(_ARMS["right"], 9)[1:], "trunk2"),
    ]
    return Sculpture(
        solid,
        (-0.60, -0.06, -0.44),
        (0.64, 1.55, 0.46),
        0.027,
        "#4cc274",
        layers,
        tuple(limbs),
    )
