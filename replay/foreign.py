"""Formats of motion that are known and not read: what to convert them with, in one line."""

from __future__ import annotations

from pathlib import Path

_BLENDER_BVH = "open it in Blender (File, Import) and export BVH (File, Export, Motion Capture)"
_HINTS = {
    ".fbx": ("FBX", _BLENDER_BVH),
    ".dae": ("COLLADA", _BLENDER_BVH),
    ".blend": ("Blender file", "open it in Blender and export BVH (File, Export, Motion Capture)"),
    ".vmd": ("MikuMikuDance motion", "open it in Blender with mmd_tools and export BVH"),
    ".mvn": ("Xsens MVN", "export MVNX or BVH from Xsens MVN (File, Export)"),
    ".npz": (
        "NumPy archive",
        "convert SMPL or AMASS motion to BVH with the SMPL add-on of Blender",
    ),
    ".tak": ("OptiTrack take", "export a table (CSV) from Motive (File, Export Tracking Data)"),
    ".usd": ("USD", _BLENDER_BVH),
    ".abc": ("Alembic", "it holds no skeleton; export the motion as BVH where it was made"),
}
_STARTS = (
    (b"Kaydara FBX Binary", ".fbx"),
    (b"; FBX", ".fbx"),
    (b"Vocaloid Motion Data", ".vmd"),
    (b"BLENDER", ".blend"),
)
_INSIDE = ((b"<COLLADA", ".dae"),)


def conversion_hint(path: Path, head: bytes) -> str | None:
    """What a file is, and what makes a recording of it; None where the format is not known.

    Args:
        path: of the file; its suffix counts where its content says nothing.
        head: its first bytes.
    """
    start = head.lstrip(b"\xef\xbb\xbf \t\r\n")
    kind = next((kind for mark, kind in _STARTS if start.startswith(mark)), None)
    kind = kind or next((kind for mark, kind in _INSIDE if mark in head), None)
    what = _HINTS.get(kind or path.suffix.lower())
    return None if what is None else f"{what[0]} is not read; {what[1]}"
