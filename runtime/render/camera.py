"""A perspective camera that frames, orbits, pans and zooms."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

Matrix = NDArray[np.float64]

DEFAULT_PITCH = math.radians(8.0)
HIGHEST_PITCH = math.radians(80.0)
HEADROOM = 0.42  # where boxes stand in spare height: 0 in the middle, 1 at the bottom
NEAREST, FARTHEST = 0.3, 60.0  # [m] from the target that a zoom goes
LEAST_FREE = 0.4  # how small strips make what they leave in view, at most
LOWEST_PITCH = math.radians(1.0)  # the eye stays above the floor


@dataclass(frozen=True, slots=True)
class Camera:
    """A perspective camera; right-handed, +Y up, the stage faces +Z.

    Attributes:
        eye: its position [m].
        target: the point in the middle of the picture [m]; `orbit` turns about it.
        fov: vertical angle of view [rad].
        near, far: depth range [m].
        shift: right and up, how far `target` is drawn from the middle of the picture, where 1 is
            its edge.
    """

    eye: tuple[float, float, float] = (0.0, 1.5, 5.0)
    target: tuple[float, float, float] = (0.0, 0.8, 0.0)
    fov: float = math.radians(26.0)
    near: float = 0.1
    far: float = 100.0
    shift: tuple[float, float] = (0.0, 0.0)

    @property
    def distance(self) -> float:
        """The distance from eye to target [m]."""
        return math.dist(self.eye, self.target)

    @property
    def view_rotation(self) -> Matrix:
        """(3, 3) world to camera directions: x right, y up, z toward the viewer."""
        back = np.subtract(self.eye, self.target) / self.distance
        right = np.cross((0.0, 1.0, 0.0), back)
        right /= np.linalg.norm(right)
        return np.array([right, np.cross(back, right), back])

    @property
    def view(self) -> Matrix:
        """(4, 4) world to camera coordinates."""
        matrix = np.eye(4)
        matrix[:3, :3] = self.view_rotation
        matrix[:3, 3] = -self.view_rotation @ np.asarray(self.eye)
        return matrix

    def projection(self, aspect: float) -> Matrix:
        """(4, 4) OpenGL clip matrix for a picture `aspect` times as wide as high."""
        scale = 1.0 / math.tan(self.fov / 2.0)
        depth = self.near - self.far
        matrix = np.zeros((4, 4))
        matrix[0, 0] = scale / aspect
        matrix[1, 1] = scale
        matrix[2, 2:] = (self.far + self.near) / depth, 2.0 * self.far * self.near / depth
        matrix[3, 2] = -1.0
        matrix[:2] += np.outer(self.shift, matrix[3])
        return matrix

    def clear_of(
        self,
        left: float,
        right: float,
        top: float,
        bottom: float,
        *,
        filled: tuple[float, float] = (1.0, 1.0),
    ) -> Camera:
        """Return a camera that draws what fills its picture clear of strips at the borders.

        It draws everything smaller where it has to, and the same middle in the middle of what is
        left; eye and target stay where they are.

        Args:
            left, right: width of the strips, as shares of the picture's.
            top, bottom: height of the strips, likewise.
            filled: share of width and height of this camera's picture that has to stay clear.
        """
        free = min(1.0, (1.0 - left - right) / filled[0], (1.0 - top - bottom) / filled[1])
        fov = 2.0 * math.atan(math.tan(self.fov / 2.0) / max(free, LEAST_FREE))
        return replace(self, fov=fov, shift=(left - right, bottom - top))

    def fills(self, bounds: ArrayLike, aspect: float) -> NDArray[np.float64]:
        """Return how far boxes reach from the middle to the edge of the picture, in x and y, (2,).

        Args:
            bounds: (2, 3) or (B, 2, 3) [m]; least and greatest corners of one or more boxes.
            aspect: width over height of the picture.
        """
        corners = box_corners(np.asarray(bounds, dtype=np.float64).reshape(-1, 2, 3))
        clip = (
            np.pad(corners, ((0, 0), (0, 1)), constant_values=1.0)
            @ (self.projection(aspect) @ self.view).T
        )
        reach: NDArray[np.float64] = np.abs(clip[:, :2] / clip[:, 3:]).max(axis=0)
        return reach

    def frame(self, bounds: ArrayLike, aspect: float, *, margin: float = 0.1) -> Camera:
        """Return a camera with the same orientation in which boxes just fill the picture.

        A point (x, y, z) in the camera's axes lies inside the right edge of slope t, seen from
        distance d with the centre at c, when d t + c >= x + z t; likewise for the left edge. The
        largest of each over all corners give c and the smallest d in closed form. More of the spare
        height goes above the boxes than below.

        Args:
            bounds: (2, 3) or (B, 2, 3) [m]; least and greatest corners of one or more boxes.
            aspect: width over height of the picture.
            margin: free share of the picture on each side, in [0, 0.5).
        """
        corners = box_corners(np.asarray(bounds, dtype=np.float64).reshape(-1, 2, 3))
        seen = corners @ self.view_rotation.T  # (8 B, 3)
        slope_y = math.tan(self.fov / 2.0) * (1.0 - 2.0 * margin)
        centre_x, distance_x = _tightest(seen[:, 0], seen[:, 2], slope_y * aspect)
        centre_y, distance_y = _tightest(seen[:, 1], seen[:, 2], slope_y)
        nearest, middle = seen[:, 2].max(), (seen[:, 2].max() + seen[:, 2].min()) / 2.0
        depth = max(distance_x, distance_y, nearest + 1e-3)
        centre_y += HEADROOM * (depth - distance_y) * slope_y
        rotation = self.view_rotation
        target = np.array([centre_x, centre_y, middle]) @ rotation
        eye = np.array([centre_x, centre_y, depth]) @ rotation
        return _placed(self, eye, target)

    def orbit(self, yaw: float, pitch: float) -> Camera:
        """Return a camera turned about the target by angles [rad]: yaw to the right, pitch up."""
        back = np.subtract(self.eye, self.target) / self.distance
        azimuth = math.atan2(back[0], back[2]) + yaw
        height = min(max(math.asin(back[1]) + pitch, LOWEST_PITCH), HIGHEST_PITCH)
        return _placed(
            self, np.asarray(self.target) + self.distance * _toward(azimuth, height), self.target
        )

    def pan(self, right: float, up: float) -> Camera:
        """Return a camera shifted sideways and up, in picture heights at the target."""
        height = 2.0 * self.distance * math.tan(self.fov / 2.0)
        shift = height * (right * self.view_rotation[0] + up * self.view_rotation[1])
        return _placed(self, np.add(self.eye, shift), np.add(self.target, shift))

    def moved(self, shift: ArrayLike, factor: float) -> Camera:
        """Return a camera with its target shifted (3,) [m], `factor` times as far from it."""
        target = np.add(self.target, shift)
        return _placed(self, target + factor * np.subtract(self.eye, self.target), target)

    def zoom(self, factor: float) -> Camera:
        """Return a camera `factor` times closer to the target, within limits."""
        distance = min(max(self.distance / factor, NEAREST), FARTHEST)
        back = np.subtract(self.eye, self.target) / self.distance
        return _placed(self, np.asarray(self.target) + distance * back, self.target)


def front_camera(*, pitch: float = DEFAULT_PITCH, fov: float = math.radians(26.0)) -> Camera:
    """Return a slightly raised camera in front of the stage: the view used for matching."""
    target = np.array([0.0, 0.8, 0.0])
    return _placed(Camera(fov=fov), target + 5.0 * _toward(0.0, pitch), target)


def _toward(azimuth: float, height: float) -> NDArray[np.float64]:
    level = math.cos(height)
    return np.array([math.sin(azimuth) * level, math.sin(height), math.cos(azimuth) * level])


def _placed(camera: Camera, eye: ArrayLike, target: ArrayLike) -> Camera:
    distance = math.dist(np.asarray(eye), np.asarray(target))
    return replace(
        camera,
        eye=tuple(np.asarray(eye, dtype=np.float64).tolist()),
        target=tuple(np.asarray(target, dtype=np.float64).tolist()),
        near=distance * 0.02,
        far=distance * 20.0,
    )


def box_corners(boxes: NDArray[np.float64]) -> NDArray[np.float64]:
    """The eight corners of boxes (B, 2, 3) as points (8 B, 3)."""
    pick = np.array(list(np.ndindex(2, 2, 2)))  # (8, 3)
    return boxes[:, pick, np.arange(3)].reshape(-1, 3)


def _tightest(
    offset: NDArray[np.float64], depth: NDArray[np.float64], slope: float
) -> tuple[float, float]:
    """Return centre and distance at which points just touch both edges of the view's wedge."""
    greatest = float((offset + depth * slope).max())
    least = float((-offset + depth * slope).max())
    return (greatest - least) / 2.0, (greatest + least) / (2.0 * slope)
