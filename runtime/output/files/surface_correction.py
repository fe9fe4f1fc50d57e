"""Morph targets that bring a skinned surface to a stated distance of the performed one."""

from __future__ import annotations

import math
import tempfile
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from runtime.output.files.node_motion import NodeMotion
from runtime.output.files.whole_file import writing
from solvers.skeleton.tree import Tree
from solvers.surface.corrective_shapes import CorrectiveShapes
from solvers.surface.skin_weights import Skin

Array = NDArray[np.float64]
Singles = NDArray[np.float32]
Indices = NDArray[np.int64]

_FLATTENED = 0.2  # of its volume: a vertex whose blended motion leaves less follows one node
_PIECE = 64  # frames that are corrected together
_SHARE = 0.8  # of the bound is for the shapes, the rest for the rounding of a player
_EVENLY = 4  # pieces over the whole show are looked at first


class SurfaceFile:
    """Keeps the surface of each frame in an unnamed file until the end of a show.

    Args:
        beside: the file lies in the folder of this one.
        vertices: how many a surface has.
    """

    def __init__(self, beside: Path, vertices: int) -> None:
        self._beside, self._vertices = beside, vertices
        with writing(beside):
            self._file = tempfile.TemporaryFile(dir=beside.parent)  # noqa: SIM115  # kept open

    def write(self, surface: NDArray[np.floating]) -> None:
        """Add one surface (N, 3).

        Raises:
            InputError: the disk fails.
        """
        with writing(self._beside):
            self._file.write(np.ascontiguousarray(surface, np.float32).data)

    def surfaces(self, count: int) -> Singles:
        """Return the first surfaces (count, N, 3), as far as they are asked for."""
        with writing(self._beside):
            self._file.flush()
        if count == 0:
            return np.zeros((0, self._vertices, 3), np.float32)
        return np.memmap(self._file, np.float32, "r", shape=(count, self._vertices, 3))

    def close(self) -> None:
        """Delete the file; may be called twice."""
        with suppress(OSError):  # of a full disk, which was told
            self._file.close()


@dataclass(frozen=True, slots=True, eq=False)
class Correction:
    """Morph targets that correct a skin.

    Attributes:
        skin: that they correct.
        vertices: (A,) ascending, that some of them move.
        targets: (S, A, 3) [m] their deltas at rest; the last one is constant.
        weights: (T, S) in [0, 1], as many players want them.
        rms: root mean square distance of a vertex from the performed surface [m].
        greatest: distance of the vertex that is furthest from it [m]. Both are not below the truth.
    """

    skin: Skin
    vertices: Indices
    targets: Singles
    weights: Singles
    rms: float
    greatest: float


def correct(
    rest: Array,
    tree: Tree,
    skin: Skin,
    motion: NodeMotion,
    performed: Singles,
    file: SurfaceFile,
    within: float,
    deltas: Callable[[int], Array | None],
) -> Correction:
    """Return what brings a skinned surface near the performed one.

    A player adds the targets at rest and lets the skin move the sum. Where nodes that turn against
    one another flatten the surface so far that this cannot be undone, a vertex follows the
    strongest of them alone.

    Args:
        rest: (N, 3) [m] the surface at rest.
        tree: the nodes at rest.
        skin: which nodes each vertex follows.
        motion: of the nodes, T frames.
        performed: (T, N, 3) [m] the surface.
        file: takes what is to be corrected, T surfaces.
        within: [m] how far a vertex may be from its place.
        deltas: what other morph targets add at rest in a frame (N, 3) [m]; None for nothing.

    Raises:
        InputError: the disk fails.
    """
    frames = len(motion.times)
    skin = _unflattened(skin, tree, motion)
    off, squares = np.zeros(len(rest)), np.zeros(len(rest))  # of the skin alone
    for frame in range(frames):
        blended, shift = _blended(skin, tree, motion, frame)
        other = deltas(frame)
        shape = rest if other is None else rest + other
        missing = performed[frame] - np.einsum("nij,nj->ni", blended, shape) - shift
        distances = np.linalg.norm(missing, axis=1)
        off, squares = np.maximum(off, distances), squares + distances**2
        file.write(np.einsum("nij,nj->ni", _inverse(blended), missing))
    moved = np.flatnonzero(off > 0.5 * within)
    if len(moved) == 0 or off.max() <= within:
        moved = moved[:0]
    shapes, weights = _shapes(file.surfaces(frames), moved, _SHARE * within)
    off[moved] = squares[moved] = 0.0
    greatest, total = float(off.max(initial=0.0)), float(squares.sum())
    for piece in _in_order(frames):
        distances = shapes.distances(file.surfaces(frames)[piece][:, moved], weights[piece])
        greatest = max(greatest, float(distances.max(initial=0.0)))
        total += float(np.sum(distances**2))
    targets, shares = _from_zero_to_one(shapes.shapes, weights)
    rms = math.sqrt(total / max(frames * len(rest), 1))
    return Correction(skin, moved, targets, shares, rms, greatest)


def _shapes(wanted: Singles, moved: Indices, within: float) -> tuple[CorrectiveShapes, Array]:
    """The shapes of the moved vertices, and their weights (T, S)."""
    frames = len(wanted)
    shapes = CorrectiveShapes(len(moved), within)
    evenly = np.unique(np.linspace(0, max(frames - 1, 0), _EVENLY * _PIECE).round().astype(int))
    for first in range(_EVENLY if frames else 0):
        shapes.add(wanted[evenly[first::_EVENLY]][:, moved])
    for piece in _in_order(frames):
        shapes.add(wanted[piece][:, moved])
    weights = np.zeros((frames, len(shapes.shapes)))
    for piece in _in_order(frames):
        weights[piece] = shapes.weights(wanted[piece][:, moved])
    return shapes, weights


def _in_order(frames: int) -> Iterator[slice]:
    """All frames, piece by piece."""
    return (slice(start, start + _PIECE) for start in range(0, frames, _PIECE))


def _from_zero_to_one(shapes: Array, weights: Array) -> tuple[Singles, Singles]:
    """The same sums by weights in [0, 1], with a constant shape at the end if there are any."""
    if len(shapes) == 0 or len(weights) == 0:
        return shapes[:0].astype(np.float32), np.zeros((len(weights), 0), np.float32)
    low, high = weights.min(axis=0), weights.max(axis=0)
    span = np.where(high > low, high - low, 1.0)
    constant = np.einsum("s,snc->nc", low, shapes)[None]
    targets = np.concatenate([shapes * span[:, None, None], constant])
    shares = np.concatenate([(weights - low) / span, np.ones((len(weights), 1))], axis=1)
    return targets.astype(np.float32), shares.astype(np.float32)


def _unflattened(skin: Skin, tree: Tree, motion: NodeMotion) -> Skin:
    """The skin with one node for each vertex that it flattens in some frame."""
    least = np.ones(len(skin.nodes))
    for frame in range(len(motion.times)):
        least = np.minimum(least, _volume(_blended(skin, tree, motion, frame)[0]))
    flat = np.flatnonzero(least < _FLATTENED)
    weights = skin.weights.copy()
    weights[flat] = 0.0
    weights[flat, skin.weights[flat].argmax(axis=1)] = 1.0
    return Skin(skin.nodes, weights)


def _blended(skin: Skin, tree: Tree, motion: NodeMotion, frame: int) -> tuple[Array, Array]:
    """The matrices (N, 3, 3) and shifts (N, 3) that linear blend skinning applies at rest."""
    turns = Rotation.from_quat(motion.rotations[frame]).as_matrix()
    moves = np.concatenate(
        [
            turns,
            (motion.positions[frame] - np.einsum("kij,kj->ki", turns, tree.positions))[..., None],
        ],
        axis=2,
    ).reshape(len(turns), 12)
    blended = np.einsum("nc,ncm->nm", skin.weights, moves[skin.nodes]).reshape(-1, 3, 4)
    return blended[..., :3], blended[..., 3]


def _volume(matrices: Array) -> Array:
    """The determinants (N,) of matrices (N, 3, 3)."""
    volume: Array = np.sum(matrices[:, 0] * np.cross(matrices[:, 1], matrices[:, 2]), axis=1)
    return volume


def _inverse(matrices: Array) -> Array:
    """The inverses (N, 3, 3)."""
    a, b, c = matrices[:, 0], matrices[:, 1], matrices[:, 2]
    columns = np.stack([np.cross(b, c), np.cross(c, a), np.cross(a, b)], axis=2)
    inverse: Array = columns / _volume(matrices)[:, None, None]
    return inverse
