"""The inset: the performer's skeleton in a small round frame at the upper left of the picture."""

from __future__ import annotations

import moderngl
import numpy as np
from numpy.typing import ArrayLike, NDArray

from devices.bodies.joint_labels import label_joints
from devices.bodies.joint_names import Kind
from devices.skeleton import Skeleton
from runtime.render.programs import link, release_all
from runtime.render.tubes import TubePainter, Tubes, tubes

IDLE = np.array([0.62, 0.60, 0.56])  # linear RGB of a joint that drives nothing
SHRINK = 0.01  # share of the spare size that the view gives up at each update
FILL = 0.88  # share of the inset's radius that the performer fills when stretched out
STRETCHED = 0.9  # of the longest way along bones: no body stretches all of it along one line
ROUND = 0.9  # of the circle round the performer is inside, where that is larger
NO_BONE = (Kind.ROOT, Kind.HELPER)


def body_bones(skeleton: Skeleton) -> tuple[NDArray[np.int64], NDArray[np.bool]]:
    """Return the bones of a body without what rigs add: a root on the floor, and helpers.

    Returns:
        (J,) int parents among the joints that are left, -1 where there is none; and (J,) bool,
        whether a joint is left.
    """
    parts = label_joints(skeleton)
    shown = np.array([part is None or part.kind not in NO_BONE for part in parts])
    if not shown.any():
        return skeleton.parents.astype(np.int64), np.ones(len(parts), dtype=np.bool)
    parents = np.full(len(parts), -1, dtype=np.int64)
    for joint in skeleton.order:
        above = int(skeleton.parents[joint])
        if above >= 0:
            parents[joint] = above if shown[above] else parents[above]
    return parents, shown


class SkeletonInset:
    """A performer's skeleton, scaled and centred so that it fits the inset without jitter.

    The view is as large as the performer is with all limbs stretched out, so that no pose changes
    it. It moves only when the performer would leave it, grows at once and shrinks slowly. It
    advances once an update, not with a clock, so replays draw the same pictures.

    Args:
        parents: (J,) int, -1 at each root.
        shown: (J,) bool, the joints that are drawn; all if None. None hangs on another one.

    Attributes:
        parents: see above.
    """

    def __init__(self, parents: ArrayLike, shown: ArrayLike | None = None) -> None:
        self.parents = np.asarray(parents, dtype=np.int64)
        every = np.ones(len(self.parents), dtype=np.bool)
        self._shown = every if shown is None else np.asarray(shown, dtype=np.bool)
        self._upward = _leaves_first(self.parents)
        self._centre: NDArray[np.float64] | None = None
        self._half = 0.0
        self._places = np.full((len(self.parents), 2), np.nan)
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
        known = np.asarray(np.isfinite(seen).all(axis=1), dtype=np.bool) & self._shown
        self._places = np.full((len(self.parents), 2), np.nan)
        if not known.any():
            self._capsules = np.empty((0, 13), dtype=np.float32)
            return
        centre = self._follow(seen[known], self._longest(seen, known))
        count = len(self.parents)
        painted = np.full((count, 3), np.nan) if colours is None else colours
        faint: NDArray[np.bool] = np.zeros(count, dtype=np.bool) if dimmed is None else dimmed
        placed = (seen - [*centre, 0.0]) / self._half
        self._places[known] = FILL * placed[known, :2]
        self._capsules = _skeleton_tubes(placed, self.parents, painted, faint, known)

    def _longest(self, seen: NDArray[np.float64], known: NDArray[np.bool]) -> float:
        """The length [m] of the longest way along bones: no pose makes the performer longer."""
        bones = np.linalg.norm(seen - seen[self.parents], axis=1)
        bones[~(known & known[self.parents])] = 0.0
        below, longest, lengths = [0.0] * len(bones), 0.0, bones.tolist()
        for joint, parent in self._upward:
            reach = below[joint] + lengths[joint]
            longest = max(longest, reach + below[parent])
            below[parent] = max(below[parent], reach)
        return longest

    def _follow(self, points: NDArray[np.float64], longest: float) -> NDArray[np.float64]:
        low, high = points[:, :2].min(axis=0), points[:, :2].max(axis=0)
        middle = (low + high) / 2.0
        circle = float(np.linalg.norm(points[:, :2] - middle, axis=1).max())
        reach = max(
            STRETCHED * longest / 2.0, float((high - low).max()) / 2.0, ROUND * circle, 1e-6
        )
        if self._centre is None:
            self._centre, self._half = middle, reach
        self._half = max(reach, self._half - SHRINK * (self._half - reach))
        spare = self._half - (high - low) / 2.0
        slack = 0.35 * np.maximum(spare, 0.0)
        centre: NDArray[np.float64] = np.clip(self._centre, middle - slack, middle + slack)
        self._centre = centre
        return centre

    @property
    def places(self) -> NDArray[np.float64]:
        """(J, 2) where the joints are drawn, right and up from the centre, in radii of the inset.

        NaN where none is drawn.
        """
        return self._places

    @property
    def capsules(self) -> Tubes:
        """(K, 13) capsules in the inset's coordinates: a unit circle, the viewer on +z."""
        return self._capsules


def _leaves_first(parents: NDArray[np.int64]) -> list[tuple[int, int]]:
    """Return each joint that has a parent, with it, before the parent."""
    depths = np.zeros(len(parents), dtype=np.int64)
    above = parents.copy()
    while (above >= 0).any():
        depths += above >= 0
        above = np.where(above >= 0, parents[above], -1)
    order = np.argsort(-depths, kind="stable").tolist()
    return [(joint, int(parents[joint])) for joint in order if parents[joint] >= 0]


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


def inset_side(size: tuple[int, int]) -> float:
    """The side [px] of the square in the upper left of a picture of `size` that the inset takes."""
    return 2.32 * max(round(0.165 * min(size)), 8)


def inset_circle(size: tuple[int, int]) -> tuple[tuple[float, float], float]:
    """The inset's centre [px] from the upper left corner of a picture of `size`, and its radius."""
    side = inset_side(size)
    return (side / 2.0, side / 2.0), side / 2.32


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
        radius = round(inset_side(target.size) / 2.32)
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
