"""Read which nodes a VRM file declares to be the bones of a humanoid.

Source: VRM Consortium, "VRM 0.x: humanoid" and "VRMC_vrm 1.0: humanoid",
"VRMC_vrm_animation 1.0".
"""

from __future__ import annotations

from replay.gltf.file import GltfFile


def humanoid_bones(file: GltfFile) -> dict[str, int]:
    """Return the node of each humanoid bone, by VRM's name for it: "leftUpperArm"; often empty.

    Raises:
        ContentError: the declaration is damaged.
    """
    count = len(file.entries("nodes"))
    new = file.document.extension("VRMC_vrm") or file.document.extension("VRMC_vrm_animation")
    old = file.document.extension("VRM")
    if new is not None:
        humanoid = new.child("humanoid")
        named = None if humanoid is None else humanoid.child("humanBones")
        bones = {} if named is None else {name: named.child(name) for name in named.fields}
        return {
            name: bone.whole("node", below=count)
            for name, bone in bones.items()
            if bone is not None
        }
    humanoid = None if old is None else old.child("humanoid")
    if humanoid is None:
        return {}
    # VRM 0.x writes -1 for a bone that the model does not have.
    present = [bone for bone in humanoid.children("humanBones") if bone.fields.get("node") != -1]
    return {
        bone.text("bone", "") or f"bone {number}": bone.whole("node", below=count)
        for number, bone in enumerate(present)
    }
