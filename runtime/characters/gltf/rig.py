"""Read characters from glTF 2.0, GLB and VRM files, with their rigs."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array, csr_array, vstack
from scipy.spatial import cKDTree

from devices.errors import ContentError, InputError
from devices.skeleton import Skeleton
from replay.gltf.file import GltfFile
from replay.gltf.humanoid import humanoid_bones
from replay.gltf.scene import Scene, read_scene
from runtime.characters.character import Material
from runtime.characters.formats.mesh_data import MeshError, plain_material
from runtime.characters.formats.mesh_file import file_content
from runtime.characters.gltf.expressions import read_expressions
from runtime.characters.gltf.joints import Rig, build_rig, with_connections
from runtime.characters.gltf.material import MaterialReader
from runtime.characters.gltf.mesh import MeshPart, read_parts
from runtime.characters.gltf.morphs import MorphReader
from runtime.characters.morphs import Expression
from runtime.characters.rig_body import body_around

Array = NDArray[np.float64]
MOST_JOINTS = 2_000
_WHITE = np.ones(4)


@dataclass(frozen=True, slots=True, eq=False)
class GltfModel:
    """A glTF file's default scene in its default pose; scene coordinates, +Y up.

    Attributes:
        file_vertices: (M, 3) in scene order.
        faces: (F, 3) into `file_vertices`.
        colors: (M, 4) linear RGBA in [0, 1], or None.
        uvs: (M, 2) as glTF has them, or None.
        materials: at least one.
        face_material: (F,) into `materials`.
        skeleton: of the file's joints, or None if it has no rig.
        weights: (M, K) of the skeleton's K joints, rows sum to 1; None without a skeleton.
        faces_backward: the character faces -Z, as VRM 0.x has it, instead of +Z.
        humanoid: the joints that the file declares to be bones of a humanoid, by VRM's names.
        notes: omissions and guesses, one short line each.
        morphs: for each morph target the vertices (e,) that it moves, and their deltas (e, 3).
        morph_names: of each target.
        expressions: that a VRM file declares, of these targets.
    """

    file_vertices: Array
    faces: NDArray[np.int64]
    colors: NDArray[np.float32] | None
    uvs: NDArray[np.float32] | None
    materials: tuple[Material, ...]
    face_material: NDArray[np.int64]
    skeleton: Skeleton | None
    weights: csr_array | None
    faces_backward: bool
    humanoid: Mapping[str, int] = field(default_factory=dict)
    notes: tuple[str, ...] = ()
    morphs: tuple[tuple[NDArray[np.int64], Array], ...] = ()
    morph_names: tuple[str, ...] = ()
    expressions: tuple[Expression, ...] = ()


def read_gltf(path: Path) -> GltfModel:
    """Read a .glb, .gltf or .vrm file; a rig without a mesh gets a wooden figure as its body.

    Raises:
        InputError: it cannot be read, is damaged or compressed, or holds neither mesh nor rig.
    """
    try:
        return _read(path)
    except ContentError as error:
        raise InputError(f"{path}: {error}") from None


def _read(path: Path) -> GltfModel:
    file = GltfFile(file_content(path), path.parent)
    scene = read_scene(file)
    look, morphs = MaterialReader(file), MorphReader(file)
    parts, notes = read_parts(file, scene, look, morphs)
    joints = _skin_joints(file, parts)
    notes += file.notes
    if not parts:
        return _dressed(file, scene, joints)
    model = _surface(parts, look, faces_backward="VRM" in _extensions(file), notes=notes)
    model = _expressive(model, file, parts, morphs)
    if joints:
        bones, faults = _declared(file)
        model = replace(model, notes=(*model.notes, *faults))
        return _rigged(model, _rig(file, scene, parts, joints), scene, parts, bones)
    bones = humanoid_bones(file)
    if not bones:
        return model
    rig = _rig(file, scene, parts, list(bones.values()))
    if not _spans(rig.skeleton, model.file_vertices):
        note = "its humanoid bones lie outside its mesh and no skin binds them: left out"
        return replace(model, notes=(*model.notes, note))
    return _rigged(model, rig, scene, parts, bones)


def _expressive(
    model: GltfModel, file: GltfFile, parts: list[MeshPart], reader: MorphReader
) -> GltfModel:
    """The model with its morph targets and expressions."""
    expressions, faults = read_expressions(file, reader)
    starts = np.cumsum([0, *(len(part.vertices) for part in parts)])
    moves: list[list[tuple[NDArray[np.int64], Array]]] = [[] for _ in reader.names]
    for part, start in zip(parts, starts, strict=False):
        for morph in part.morphs:
            moves[morph.target].append((morph.vertices + start, morph.deltas))
    none = np.zeros(0, dtype=np.int64), np.zeros((0, 3))
    return replace(
        model,
        morphs=tuple(
            (
                np.concatenate([none[0], *(vertices for vertices, _ in each)]),
                np.concatenate([none[1], *(deltas for _, deltas in each)]),
            )
            for each in moves
        ),
        morph_names=tuple(reader.names),
        expressions=expressions,
        notes=(*model.notes, *dict.fromkeys(reader.notes), *faults),
    )


def _extensions(file: GltfFile) -> frozenset[str]:
    extensions = file.document.child("extensions")
    return frozenset() if extensions is None else frozenset(extensions.fields)


def _skin_joints(file: GltfFile, parts: list[MeshPart]) -> list[int]:
    """The joints of the skins that the parts use; of all skins if they use none."""
    count = len(file.entries("nodes"))
    worn = [file.entry("nodes", p.node).whole("skin") for p in parts if p.weights is not None]
    skins = list(dict.fromkeys(worn)) or list(range(len(file.entries("skins"))))
    joints = [file.entry("skins", skin).wholes("joints", below=count) for skin in skins]
    return list(dict.fromkeys(joint for some in joints for joint in some))


def _declared(file: GltfFile) -> tuple[dict[str, int], tuple[str, ...]]:
    """The nodes of the humanoid's bones; none and a note where their declaration is damaged.

    A skin moves the character without them.
    """
    try:
        return humanoid_bones(file), ()
    except ContentError as error:
        return {}, (f"its humanoid bones are left out: {error}",)


def _rig(file: GltfFile, scene: Scene, parts: list[MeshPart], joints: list[int]) -> Rig:
    count = len(scene.parents)
    connected = with_connections(scene, joints)
    if len(connected) > MOST_JOINTS:
        raise MeshError(f"its rig has {len(connected)} joints, more than {MOST_JOINTS}")
    weight = np.zeros(count)
    for part in parts:
        carrier = _carrier(scene, part.node, connected)
        if part.weights is not None:
            weight += part.weights.sum(axis=0)
        elif carrier is not None:
            weight[carrier] += len(part.vertices)
    if parts and not weight.any():
        weight[:] = 1.0  # nothing is bound to a joint: keep all joints
    names = [
        node.text("name", "") or f"node {index}" for index, node in enumerate(file.entries("nodes"))
    ]
    return build_rig(scene, connected, weight, names, moving=bool(parts))


def _carrier(scene: Scene, node: int, joints: set[int]) -> int | None:
    """The nearest joint at or above a node."""
    return next((other for other in (node, *scene.ancestors(node)) if other in joints), None)


def _spans(skeleton: Skeleton, vertices: Array) -> bool:
    """Whether a skeleton lies in a mesh's bounding box, enlarged by a quarter, and is not tiny."""
    lower, upper = vertices.min(axis=0), vertices.max(axis=0)
    size = np.linalg.norm(upper - lower)
    rest = skeleton.rest_positions
    inside = (rest >= lower - 0.25 * size) & (rest <= upper + 0.25 * size)
    return bool(inside.all() and np.linalg.norm(np.ptp(rest, axis=0)) > 0.25 * size)


def _rigged(
    model: GltfModel, rig: Rig, scene: Scene, parts: list[MeshPart], bones: Mapping[str, int]
) -> GltfModel:
    """The model with its skeleton and weights for every vertex; unchanged for a single joint."""
    if len(rig.skeleton.names) < 2:
        return replace(model, notes=(*model.notes, "its joints stand at one place: left out"))
    count, known = len(scene.parents), len(rig.skeleton.names)
    kept = np.flatnonzero(rig.joint_of >= 0)
    joints = coo_array(
        (np.ones(len(kept)), (kept, rig.joint_of[kept])), shape=(count, known)
    ).tocsr()
    carriers = set(kept.tolist())
    nearest = cKDTree(rig.skeleton.rest_positions)
    blocks: list[csr_array] = []
    loose = 0
    for part in parts:
        carrier = _carrier(scene, part.node, carriers)
        if part.weights is not None:
            blocks.append(part.weights @ joints)
            continue
        if carrier is not None:
            bound = np.full(len(part.vertices), rig.joint_of[carrier])
        else:
            bound = nearest.query(part.vertices)[1]
            loose += 1
        ones, rows = np.ones(len(bound)), np.arange(len(bound))
        blocks.append(coo_array((ones, (rows, bound)), shape=(len(bound), known)).tocsr())
    notes = model.notes
    if loose:
        notes = (*notes, f"{loose} parts without a joint follow the nearest one")
    weights = csr_array(vstack(blocks, format="csr"))
    humanoid = _joints_of(bones, rig)
    return replace(model, skeleton=rig.skeleton, weights=weights, humanoid=humanoid, notes=notes)


def _joints_of(bones: Mapping[str, int], rig: Rig) -> dict[str, int]:
    """The joint of each bone, instead of its node; without those that are no joints."""
    joints = {name: int(rig.joint_of[node]) for name, node in bones.items()}
    return {name: joint for name, joint in joints.items() if joint >= 0}


def _surface(
    parts: list[MeshPart], look: MaterialReader, *, faces_backward: bool, notes: list[str]
) -> GltfModel:
    """All parts as one model without a rig."""
    starts = np.cumsum([0, *(len(part.vertices) for part in parts)])
    vertices = np.concatenate([part.vertices for part in parts])
    if not (np.abs(vertices) < 1e15).all():
        raise MeshError("its pose takes vertices beyond all bounds; export the model again")
    faces = [part.faces + start for part, start in zip(parts, starts, strict=False)]
    slots = [np.full(len(part.faces), part.material) for part in parts]
    colors = uvs = None
    if any(part.colors is not None for part in parts):
        colors = np.concatenate(
            [np.tile(_WHITE, (len(p.vertices), 1)) if p.colors is None else p.colors for p in parts]
        ).astype(np.float32)
    if any(part.uvs is not None for part in parts):
        uvs = np.concatenate(
            [np.zeros((len(p.vertices), 2)) if p.uvs is None else p.uvs for p in parts]
        ).astype(np.float32)
    return GltfModel(
        file_vertices=vertices,
        faces=np.concatenate(faces),
        colors=colors,
        uvs=uvs,
        materials=tuple(look.materials),
        face_material=np.concatenate(slots).astype(np.int64),
        skeleton=None,
        weights=None,
        faces_backward=faces_backward,
        notes=(*notes, *dict.fromkeys(look.notes)),
    )


def _dressed(file: GltfFile, scene: Scene, joints: list[int]) -> GltfModel:
    """A rig without a mesh, with a wooden figure as its body."""
    bones, faults = _declared(file) if joints else (humanoid_bones(file), ())
    joints = joints or list(bones.values())
    if not joints:
        raise MeshError("it holds neither triangles nor a rig; export it with its mesh")
    rig = _rig(file, scene, [], joints)
    if not np.ptp(rig.skeleton.rest_positions, axis=0).max() > 1e-9:
        raise MeshError("it holds no triangles, and all joints of its rig stand at one place")
    vertices, faces, weights = body_around(rig.skeleton)
    return GltfModel(
        file_vertices=vertices,
        faces=faces,
        colors=None,
        uvs=None,
        materials=(plain_material(),),
        face_material=np.zeros(len(faces), dtype=np.int64),
        skeleton=rig.skeleton,
        weights=weights,
        faces_backward="VRM" in _extensions(file),
        humanoid=_joints_of(bones, rig),
        notes=("the file holds a rig without a mesh: a wooden figure is its body", *faults),
    )
