"""Default colours for meshes without any, and the conversion from sRGB to linear colours."""

from __future__ import annotations

import hashlib

import numpy as np
from numpy.typing import NDArray

PALETTE = (  # sRGB: visible on a dark stage; no skin tones, no warning colours
    (0xE0, 0x7A, 0x5F),  # terracotta
    (0x3D, 0xA5, 0xA0),  # teal
    (0xE9, 0xB4, 0x4C),  # marigold
    (0x5B, 0x8D, 0xD9),  # cornflower
    (0x8F, 0xB9, 0x5B),  # moss
    (0xB2, 0x7C, 0xC9),  # orchid
    (0xD9, 0x6C, 0x8E),  # rose
    (0x6F, 0xB7, 0xD6),  # sky
)


def linear_from_srgb(encoded: NDArray[np.float64]) -> NDArray[np.float32]:
    """Linear RGBA (n, 4) of sRGB colours (n, 3) or (n, 4) in [0, 1]. Source: IEC 61966-2-1."""
    clipped = np.clip(encoded, 0.0, 1.0)
    rgb = clipped[:, :3]
    linear = np.where(rgb <= 0.04045, rgb / 12.92, ((rgb + 0.055) / 1.055) ** 2.4)
    alpha = clipped[:, 3:4] if clipped.shape[1] == 4 else np.ones((len(rgb), 1))
    return np.column_stack([linear, alpha]).astype(np.float32)


def palette_color(vertices: NDArray[np.float64], faces: NDArray[np.int64]) -> NDArray[np.float32]:
    """A linear RGBA (4,) chosen by a hash of the surface: vertices (N, 3), faces (F, 3)."""
    digest = hashlib.sha256(np.ascontiguousarray(vertices, dtype="<f4").tobytes())
    digest.update(np.ascontiguousarray(faces, dtype="<i4").tobytes())
    srgb = PALETTE[digest.digest()[0] % len(PALETTE)]
    color: NDArray[np.float32] = linear_from_srgb(np.array([srgb]) / 255.0)[0]
    return color
