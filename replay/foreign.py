"""Known formats of motion and characters that are not read, and the program that converts each."""

from __future__ import annotations

from pathlib import Path

_TO_GLB = "save it as .glb (File > Export > glTF 2.0)"
_BLENDER = f"open it in Blender (File > Import) and {_TO_GLB}"
_MMD = f"open it in Blender with the add-on mmd_tools and {_TO_GLB}"
_TO_FBX = f"save it as FBX there, open that in Blender (File > Import) and {_TO_GLB}"
_MAYA = f"open it in Maya, {_TO_FBX}"
_USD = f"open it in Blender (File > Import > Universal Scene Description) and {_TO_GLB}"
_HINTS = {
    ".fbx": ("FBX", f"open it in Blender (File > Import > FBX) and {_TO_GLB}"),
    ".dae": ("COLLADA", f"open it in Blender before 5.0 (File > Import > Collada) and {_TO_GLB}"),
    ".blend": ("a Blender file", f"open it in Blender and {_TO_GLB}"),
    ".vmd": ("motion of MikuMikuDance", _MMD),
    ".pmx": ("a model of MikuMikuDance", _MMD),
    ".pmd": ("a model of MikuMikuDance", _MMD),
    ".max": ("a scene of 3ds Max", f"open it in 3ds Max, {_TO_FBX}"),
    ".bip": ("motion of 3ds Max", f"open it in 3ds Max on a Biped, {_TO_FBX}"),
    ".3ds": ("3DS", f"open it in Blender with the add-on 3DS and {_TO_GLB}"),
    **dict.fromkeys((".ma", ".mb"), ("a scene of Maya", _MAYA)),
    ".anim": ("an animation of Maya or Unity", f"open it there, {_TO_FBX}"),
    ".unitypackage": ("a package of Unity", f"open it in Unity, {_TO_FBX}"),
    ".c4d": ("a scene of Cinema 4D", "export it there as glTF (.glb)"),
    **dict.fromkeys((".usd", ".usda", ".usdc", ".usdz"), ("USD", _USD)),
    ".abc": ("Alembic", "it holds no skeleton; save the scene as .glb where it was made"),
    ".x3d": ("X3D", _BLENDER),
    ".mvn": ("a file of Xsens MVN", "export MVNX from MVN (File > Export)"),
    ".tak": ("a take of OptiTrack", "export CSV from Motive (File > Export Tracking Data)"),
    ".npz": (
        "this NumPy archive",
        "only motion of SMPL bodies (AMASS) is: poses, trans, mocap_framerate",
    ),
    ".mot": ("motion of OpenSim", "name the .trc of its markers"),
    ".sto": ("storage of OpenSim", "name the .trc of its markers"),
    ".zip": ("an archive", "unpack it, and name the file in it"),
}
_STARTS = (
    (b"Kaydara FBX Binary", ".fbx"),
    (b"; FBX", ".fbx"),
    (b"Vocaloid Motion Data", ".vmd"),
    (b"BLENDER", ".blend"),
    (b"PMX ", ".pmx"),
    (b"#usda", ".usda"),
    (b"PXR-USDC", ".usdc"),
    (b"//Maya ASCII", ".ma"),
)
_INSIDE = ((b"<COLLADA", ".dae"),)


def conversion_hint(path: Path, head: bytes = b"") -> str | None:
    """The format of a file and the program that converts it; None if the format is not known.

    Args:
        path: of the file; its suffix, in any case, counts where its content says nothing.
        head: its first bytes.
    """
    start = head.lstrip(b"\xef\xbb\xbf \t\r\n")
    kind = next((kind for mark, kind in _STARTS if start.startswith(mark)), None)
    kind = kind or next((kind for mark, kind in _INSIDE if mark in head), None)
    what = _HINTS.get(kind or path.suffix.lower())
    return None if what is None else f"{what[0]} is not read; {what[1]}"
