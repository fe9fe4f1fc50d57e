"""The uniform block that all render passes share: camera, key light, floor, pools of light."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from runtime.render.camera import Camera, box_corners

MAX_POOLS = 16
KEY_DIRECTION = np.array([-0.66, 0.90, 0.52]) / np.linalg.norm([-0.66, 0.90, 0.52])

FRAME = np.dtype(
    [
        ("view_projection", "f4", (4, 4)),  # matrices are stored by columns, as GLSL has them
        ("inverse_view_projection", "f4", (4, 4)),
        ("light", "f4", (4, 4)),
        ("eye", "f4", 4),
        ("key", "f4", 4),
        ("floor_area", "f4", 4),
        ("stage", "f4", 4),
        ("picture", "f4", 4),
        ("pools", "f4", (MAX_POOLS, 4)),
    ]
)


@dataclass(frozen=True, slots=True, eq=False)
class Lighting:
    """The shadow map, the height map and the floor area, fitted to the characters' boxes.

    Attributes:
        to_shadow_clip: (4, 4) world to the clip space of the shadow map.
        to_height_clip: (4, 4) world to the clip space of the height map, seen from below the floor.
        floor: (4,) least x, least z, width and depth [m] of the floor area with shadows.
        texel: size of one texel of the shadow map [m].
    """

    to_shadow_clip: NDArray[np.float64]
    to_height_clip: NDArray[np.float64]
    floor: NDArray[np.float64]
    texel: float


CONTACT_HEIGHT = 0.32  # surfaces higher above the floor leave no contact shadow [m]
SHADOW_SIZE = 1024


def lighting(boxes: NDArray[np.float64]) -> Lighting:
    """Fit shadow and height maps around boxes (B, 2, 3).

    Extents are rounded outward to whole steps: small movements do not change the maps, so shadows
    do not shimmer.
    """
    corners = box_corners(boxes)
    landing = corners - KEY_DIRECTION * (corners[:, 1:2] / KEY_DIRECTION[1])
    reach = np.vstack([corners, landing])
    axes = _light_axes()
    low, high = _rounded(reach @ axes.T, 0.125)
    to_light = np.eye(4)
    to_light[:3, :3] = axes
    floor_low, floor_high = _rounded(reach[:, [0, 2]] + 0.0, 0.25)
    floor_low, floor_high = floor_low - 0.25, floor_high + 0.25
    below = np.array([[1.0, 0, 0, 0], [0, 0, 1.0, 0], [0, 1.0, 0, 0], [0, 0, 0, 1.0]])
    return Lighting(
        to_shadow_clip=_box_to_clip(low, high, near_is_high=True) @ to_light,
        to_height_clip=_box_to_clip(
            np.array([*floor_low, -0.05]), np.array([*floor_high, CONTACT_HEIGHT])
        )
        @ below,
        floor=np.concatenate([floor_low, floor_high - floor_low]),
        texel=float((high - low)[:2].max() / SHADOW_SIZE),
    )


def _light_axes() -> NDArray[np.float64]:
    right = np.cross((0.0, 1.0, 0.0), KEY_DIRECTION)
    right /= np.linalg.norm(right)
    return np.array([right, np.cross(KEY_DIRECTION, right), KEY_DIRECTION])


def _rounded(
    points: NDArray[np.float64], step: float
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    low = np.floor(points.min(axis=0) / step - 0.1) * step
    high = np.ceil(points.max(axis=0) / step + 0.1) * step
    return low, high


def _box_to_clip(
    low: NDArray[np.float64], high: NDArray[np.float64], *, near_is_high: bool = False
) -> NDArray[np.float64]:
    matrix = np.diag(np.append(2.0 / (high - low), 1.0))
    matrix[:3, 3] = -(high + low) / (high - low)
    if near_is_high:
        matrix[2] *= (-1.0, -1.0, -1.0, -1.0)
    return matrix


@dataclass(frozen=True, slots=True)
class StageSet:
    """Where the curtain hangs, in a ring round the characters.

    Attributes:
        x, z: [m] its centre.
        radius: [m].
        slide: [m] by which its cloth slides along it, to the left.
    """

    x: float
    z: float
    radius: float
    slide: float = 0.0


def stage_set(marks: NDArray[np.float64], slide: float = 0.0) -> StageSet:
    """Hang the curtain round places (R, 2) [m], x and z, where characters are or will be."""
    low, high = marks.min(axis=0), marks.max(axis=0)
    x, z = (low + high) / 2.0
    radius = max(3.6, 0.62 * float((high - low).max()) + 2.6)
    return StageSet(float(x), float(z), radius, slide)


def frame_block(
    camera: Camera,
    size: tuple[int, int],
    light: Lighting,
    pools: NDArray[np.float64],
    around: StageSet,
    *,
    on_floor: bool,
    reflected: bool = False,
) -> NDArray[np.void]:
    """Return the uniform block of one frame.

    Args:
        camera: the camera.
        size: width and height of the picture [px].
        light: the result of `lighting`.
        pools: (P, 3) x, z and radius [m] of each pool of light.
        around: the curtain.
        on_floor: whether there is a floor; a floor hides everything below it.
        reflected: whether the block is for the reflection in the floor, upside down.
    """
    width, height = size
    flip = np.diag([1.0, -1.0 if reflected else 1.0, 1.0, 1.0])
    view_projection = camera.projection(width / height) @ camera.view @ flip
    half = np.eye(4) * (0.5, 0.5, 0.5, 1.0)
    half[:3, 3] = 0.5, 0.5, 0.4985  # a small offset toward the light: no surface shadows itself
    block = np.zeros((), dtype=FRAME)
    block["view_projection"] = view_projection.T
    block["inverse_view_projection"] = np.linalg.inv(view_projection).T
    block["light"] = (half @ light.to_shadow_clip).T
    block["eye"] = (*(flip[:3, :3] @ np.asarray(camera.eye)), -1.0 if reflected else 1.0)
    block["key"] = (*KEY_DIRECTION, float(on_floor))
    block["floor_area"] = (*light.floor[:2], *(1.0 / light.floor[2:]))
    block["stage"] = (around.x, around.z, around.radius, len(pools))
    pixels = height / (2.0 * np.tan(camera.fov / 2.0))
    block["picture"] = (width, height, pixels, around.slide)
    block["pools"][: len(pools), :3] = pools
    return block


def covered(
    camera: Camera, size: tuple[int, int], boxes: NDArray[np.float64]
) -> tuple[int, int, int, int]:
    """Return the part of the picture that boxes can cover: left, bottom, width, height [px].

    Args:
        camera: the camera.
        size: width and height of the picture [px].
        boxes: (B, 2, 3) [m] least and greatest corners.
    """
    width, height = size
    points = np.pad(box_corners(boxes), ((0, 0), (0, 1)), constant_values=1.0)
    clip = points @ (camera.projection(width / height) @ camera.view).T
    if not len(points) or clip[:, 3].min() < camera.near:
        return 0, 0, width, height
    pixels = (clip[:, :2] / clip[:, 3:] * 0.5 + 0.5) * (width, height)
    low = np.clip(np.floor(pixels.min(axis=0)) - 1, 0, size).astype(int)
    high = np.clip(np.ceil(pixels.max(axis=0)) + 1, 0, size).astype(int)
    return int(low[0]), int(low[1]), int(high[0] - low[0]), int(high[1] - low[1])
