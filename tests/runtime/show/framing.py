"""Where what is framed lies in the picture."""

from __future__ import annotations

import numpy as np

from runtime.render.camera import Camera, box_corners
from runtime.show.scene import MARGIN

SIZE = (96, 54)
FULL = 1.0 - 2.0 * MARGIN  # how far from the middle what is framed may be, 1 at the edge
WIDE = ((0.24, 0.72, -0.16), (1.6, 0.96, 0.16))


def reach(camera: Camera, boxes: np.ndarray, aspect: float) -> np.ndarray:
    """How far from the middle (n, 2) the corners of boxes are in the picture, 1 at its edge."""
    corners = box_corners(np.asarray(boxes))
    points = np.column_stack([corners, np.ones(len(corners))])
    clip = points @ (camera.projection(aspect) @ camera.view).T
    assert (clip[:, 3] > 0.0).all(), "before the camera"
    return np.abs(clip[:, :2] / clip[:, 3:])
