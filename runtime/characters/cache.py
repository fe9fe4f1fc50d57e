"""Keep extracted skeletons in the user's cache folder, by a hash of their mesh."""

from __future__ import annotations

import hashlib
import io
import os
import tempfile
import zipfile
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from solvers.kernels.cache import cache_folder

Tree = tuple[NDArray[np.int64], NDArray[np.float64]]  # parents (K,), positions (K, 3)
Extract = Callable[[NDArray[np.float64], NDArray[np.int64]], Tree]

MOST_BYTES = 1 << 20


def cached_skeleton(
    vertices: NDArray[np.float64], faces: NDArray[np.int64], extract: Extract, version: int
) -> Tree:
    """Return `extract(vertices, faces)`, from the cache if it holds the result.

    The key is a hash of all bits of vertices (N, 3) and faces (F, 3) and of the version of the
    extraction. A damaged cache file is computed anew; a folder that cannot be written is no error.
    """
    path = cache_folder() / "skeletons" / f"{_key(vertices, faces, version)}.npz"
    tree = _stored(path)
    if tree is None:
        tree = extract(vertices, faces)
        with suppress(OSError):
            _store(path, tree)
    return tree


def _key(vertices: NDArray[np.float64], faces: NDArray[np.int64], version: int) -> str:
    digest = hashlib.sha256(f"skeleton {version} {vertices.shape} {faces.shape}".encode())
    digest.update(np.ascontiguousarray(vertices, dtype="<f8").tobytes())
    digest.update(np.ascontiguousarray(faces, dtype="<i8").tobytes())
    return digest.hexdigest()


def _stored(path: Path) -> Tree | None:
    """The tree in a file, or None where there is none or it is damaged."""
    try:
        if path.stat().st_size > MOST_BYTES:
            return None
        with np.load(io.BytesIO(path.read_bytes()), allow_pickle=False) as stored:
            parents = np.asarray(stored["parents"], dtype=np.int64)
            positions = np.asarray(stored["positions"], dtype=np.float64)
    except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile, NotImplementedError):
        return None
    if parents.size == 0 or parents.ndim != 1 or positions.shape != (len(parents), 3):
        return None
    if not np.isfinite(positions).all():
        return None
    return (parents, positions) if _is_tree(parents) else None


def _is_tree(parents: NDArray[np.int64]) -> bool:
    """Whether there is one root and every other node's parent comes before it."""
    return bool(
        parents[0] == -1 and ((parents >= 0) & (parents < np.arange(len(parents))))[1:].all()
    )


def _store(path: Path, tree: Tree) -> None:
    """Write to a temporary file, then rename: another process never sees half a file."""
    path.parent.mkdir(parents=True, exist_ok=True)
    handle, name = tempfile.mkstemp(dir=path.parent, suffix=".part")
    try:
        with os.fdopen(handle, "wb") as file:
            np.savez(file, parents=tree[0], positions=tree[1])
        Path(name).replace(path)
    except BaseException:
        Path(name).unlink(missing_ok=True)
        raise
