"""The motion of a character's nodes over a whole show, for exporters."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from devices.skeleton import Skeleton
from runtime.output.output import PerformedFrame


@dataclass(frozen=True, slots=True, eq=False)
class NodeMotion:
    """Positions and rotations of every node in every frame, on the stage.

    Attributes:
        times: (T,) [s] since the first frame, strictly increasing.
        positions: (T, K, 3) [m].
        rotations: (T, K, 4) unit quaternions (x, y, z, w), world, since the rest pose; their signs
            are chosen so that consecutive quaternions are close.
    """

    times: NDArray[np.float64]
    positions: NDArray[np.float64]
    rotations: NDArray[np.float64]

    def local(self, skeleton: Skeleton) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return the translation (T, K, 3) and rotation (T, K, 4) of each node in its parent.

        At rest, the axes of every node are parallel to the stage's, so the local rotations of the
        rest pose are identities. The root's parent is the stage.
        """
        frames, nodes = self.positions.shape[:2]
        translations, rotations = self.positions.copy(), self.rotations.copy()
        for node in range(nodes):
            parent = skeleton.parents[node]
            if parent < 0 or frames == 0:
                continue
            to_parent = Rotation.from_quat(self.rotations[:, parent]).inv()
            offsets = self.positions[:, node] - self.positions[:, parent]
            translations[:, node] = to_parent.apply(offsets)
            turns = to_parent * Rotation.from_quat(self.rotations[:, node])
            rotations[:, node] = turns.as_quat()
        return translations, continuous_signs(rotations)


class NodeMotionRecorder:
    """Collects the motion of the nodes: 28 bytes per node and frame."""

    def __init__(self, nodes: int) -> None:
        self._nodes = nodes
        self._times: list[float] = []
        self._positions: list[NDArray[np.float32]] = []
        self._rotations: list[NDArray[np.float32]] = []

    def add(self, frame: PerformedFrame) -> bool:
        """Store one frame, unless its time equals that of the frame before; return whether."""
        if self._times and np.float32(frame.time - self._times[0]) <= np.float32(
            self._times[-1] - self._times[0]
        ):
            return False  # files store times as float32, which must increase
        nodes = frame.nodes_for("an exported skeleton")
        self._times.append(frame.time)
        self._positions.append(nodes.positions.astype(np.float32))
        self._rotations.append(nodes.rotations.astype(np.float32))
        return True

    def motion(self) -> NodeMotion:
        """Return everything collected so far."""
        frames = len(self._times)
        times = np.array(self._times, np.float64)
        positions = np.array(self._positions, np.float64).reshape(frames, self._nodes, 3)
        rotations = np.array(self._rotations, np.float64).reshape(frames, self._nodes, 4)
        rotations /= np.linalg.norm(rotations, axis=-1, keepdims=True)
        return NodeMotion(times - times[:1].sum(), positions, continuous_signs(rotations))


def continuous_signs(quaternions: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the same rotations (T, ..., 4) with signs that make consecutive quaternions close.

    Otherwise programs that interpolate the four numbers separately would turn the long way round.
    """
    if len(quaternions) == 0:
        return quaternions
    flips = np.sum(quaternions[1:] * quaternions[:-1], axis=-1) < 0
    first = np.ones((1, *flips.shape[1:]))
    signs = np.cumprod(np.concatenate([first, np.where(flips, -1.0, 1.0)]), axis=0)
    signed: NDArray[np.float64] = quaternions * signs[..., None]
    return signed
