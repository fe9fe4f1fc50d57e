"""The inset: the performer's skeleton in a small round frame at the upper left of the picture."""

from __future__ import annotations

import moderngl
import numpy as np
from numpy.typing import ArrayLike, NDArray

from runtime.render.programs import link, release_all
from runtime.render.tubes import TubePainter, Tubes, tubes

IDLE = np.array([0.62, 0.60, 0.56])  # linear RGB of a joint that drives nothing
SHRINK = 0.01  # share of the spare size that the view gives up at each update
FILL = 0.74  # share of the inset's radius that the performer fills


class SkeletonInset:
    """A performer's skeleton, scaled and centred so that it fits the inset without jitter.

    The view moves only when the performer would leave it, grows at once and shrinks slowly. It
    advances once an update, not with a clock, so replays draw the same pictures.

    Attributes:
        parents: (J,) int, -1 at the root.
    """

    def __init__(self, parents: ArrayLike) -> None:
        self.parents = np.asarray(parents, dtype=np.int64)
        self._centre: NDArray[np.float64] | None = None
        self._half = 0.0
        self._capsules: Tubes = np.empty((0, 13), dtype=np.float32)

    def update(
        self,
        positions: NDArray[np.float64],
        *,
        colours: NDArray[np.float64] | None = None,
        dimmed: NDArray[np.bool] | None = None,
        view_rotation: NDArray[np.float64] | None = None,
    ) -> None:
        """Show one frame of the performer.

        Args:
            positions: (J, 3) [m]; joints with NaN are not drawn.
            colours: (J, 3) linear RGB; NaN rows, or None for all: the joint drives nothing.
            dimmed: (J,) joints that the fill stage estimated; they are drawn faintly.
            view_rotation: (3, 3) world to the viewer's axes; None for the front view.
        """
        seen = positions if view_rotation is None else positions @ view_rotation.T
        known = np.asarray(np.isfinite(seen).all(axis=1), dtype=np.bool)
        if not known.any():
            self._capsules = np.empty((0, 13), dtype=np.float32)
            return
        centre = self._follow(seen[known])
        count = len(self.parents)
        painted = np.full((count, 3), np.nan) if colours is None else colours
        faint: NDArray[np.bool] = np.zeros(count, dtype=np.bool) if dimmed is None else dimmed
        placed = (seen - [*centre, 0.0]) / self._half
        self._capsules = _skeleton_tubes(placed, self.parents, painted, faint, known)

    def _follow(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        low, high = points[:, :2].min(axis=0), points[:, :2].max(axis=0)
        middle = (low + high) / 2.0
        reach = max(float(np.linalg.norm(points[:, :2] - middle, axis=1).max()), 1e-6)
        if self._centre is None:
            self._centre, self._half = middle, reach
        self._half = max(reach, self._half - SHRINK * (self._half - reach))
        spare = self._half - (high - low) / 2.0
        slack = 0.35 * np.maximum(spare, 0.0)
        centre: NDArray[np.float64] = np.clip(self._centre, middle - slack, middle + slack)
        self._centre = centre
        return centre

    @property
    def capsules(self) -> Tubes:
        """(K, 13) capsules in the inset's coordinates: a unit circle, the viewer on +z."""
        return self._capsules


def _skeleton_tubes(
    joints: NDArray[np.float64],
    parents: NDArray[np.int64],
    colours: NDArray[np.float64],
    dimmed: NDArray[np.bool],
    known: NDArray[np.bool],
) -> Tubes:
    """Return bones from parent to child in the child's colour, and beads; far ones first."""
    driven = np.asarray(np.isfinite(colours).all(axis=1), dtype=np.bool)
    colour = np.where(driven[:, None], colours, IDLE)
    opacity = np.where(dimmed, 0.28, 1.0)
    child = np.flatnonzero((parents >= 0) & known & known[parents])
    crowd = np.clip(25.0 / max(len(child), 1), 0.45, 1.0)  # thinner where there are many joints
    width = np.where(driven, 0.046, 0.030) * crowd
    bones = tubes(
        joints[parents[child]],
        joints[child],
        np.column_stack([width[child] * 1.15, width[child] * 0.85]),
        colour[child],
        opacity=opacity[child],
    )
    beads = tubes(
        joints[known],
        joints[known],
        width[known] * 1.45,
        colour[known],
        opacity=opacity[known],
    )
    glow = bones[driven[child]].copy()
    glow[:, 11] *= 0.35
    glow[:, 12] = 2.6
    solid = np.vstack([bones, beads])
    depth = np.concatenate([(joints[child, 2] + joints[parents[child], 2]) / 2.0, joints[known, 2]])
    return np.vstack([glow, solid[np.argsort(depth, kind="stable")]])


class InsetPainter:
    """Draws an inset's disc and skeleton into a corner of the bound framebuffer."""

    def __init__(self, context: moderngl.Context) -> None:
        self._program = link(context, "whole", "inset_disc")
        self._array = context.vertex_array(self._program, [])

    def draw(
        self, inset: SkeletonInset, painter: TubePainter, target: moderngl.Framebuffer
    ) -> None:
        """Draw at the upper left; the diameter is a third of the picture's height."""
        width, height = target.size
        radius = max(round(0.165 * min(height, width)), 8)
        centre = (radius * 1.16, height - radius * 1.16)
        corner = int(centre[0] - radius * 1.16), int(centre[1] - radius * 1.16)
        target.scissor = (*corner, int(radius * 2.5), int(radius * 2.32) + 1)
        self._program["disc"] = (*centre, float(radius))
        self._array.render(moderngl.TRIANGLES, vertices=3)
        to_clip = np.eye(4) * (FILL, FILL, 1.0, 1.0)
        box = (round(centre[0] - radius), round(centre[1] - radius), 2 * radius, 2 * radius)
        target.viewport = box
        target.scissor = box
        painter.draw(
            inset.capsules,
            to_clip,
            size=(2.0 * radius, 2.0 * radius),
            pixels=radius * FILL,
            origin=(float(box[0]), float(box[1])),
            least=0.7,
        )
        target.viewport = (0, 0, width, height)
        target.scissor = (0, 0, width, height)

    def release(self) -> None:
        """Free its GL objects."""
        release_all(self._array, self._program)
