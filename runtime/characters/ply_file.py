"""PLY files, ASCII and binary, by way of trimesh."""

from __future__ import annotations

import io

import numpy as np

from runtime.characters.mesh_data import FileMesh, MeshError, check_counts
from runtime.characters.palette import linear_from_srgb


def read_ply(content: bytes) -> FileMesh:
    """Read a PLY file with its vertices in file order and their colours, taken as sRGB.

    Raises:
        MeshError: what is wrong with it.
    """
    import trimesh  # noqa: PLC0415  (half a second, and only some characters need it)

    if not content.startswith(b"ply"):
        raise MeshError("it does not begin with ply: no PLY file")
    try:
        loaded = trimesh.load(io.BytesIO(content), file_type="ply", process=False)
    except Exception as error:  # the parser has no exceptions of its own: any of NumPy's and more
        raise MeshError(f"it is damaged or cut short ({type(error).__name__})") from None
    vertices = np.asarray(loaded.vertices, dtype=np.float64)
    faces = np.asarray(getattr(loaded, "faces", np.zeros((0, 3))), dtype=np.int64)
    check_counts(len(vertices), len(faces))
    colors = None
    if loaded.visual.kind == "vertex":
        colors = linear_from_srgb(np.asarray(loaded.visual.vertex_colors) / 255.0)
    return FileMesh(vertices, faces, colors)
