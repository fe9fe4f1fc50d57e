"""Read the triangles of a glTF file in scene coordinates, skinned for the default pose.

Source: Khronos, "glTF 2.0 Specification", section 3.7 (meshes, skins).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array, csr_array

from replay.gltf.checked_json import Entry
from replay.gltf.file import COMPRESSIONS, GltfFile, compressed
from replay.gltf.scene import MOST_NODES, Scene
from runtime.characters.formats.mesh_data import MOST_FACES, MOST_VERTICES, MeshError
from runtime.characters.gltf.material import MaterialReader, texture_coordinates
from runtime.characters.gltf.morphs import MorphReader, PartMorph, shaped

Array = NDArray[np.float64]
_SEVERAL = ("VEC4", "VEC3", "VEC2", "SCALAR")  # joints of a vertex; glTF allows only four
_TRIANGLES, _STRIP, _FAN = 4, 5, 6


@dataclass(frozen=True, slots=True, eq=False)
class MeshPart:
    """One primitive of one node.

    Attributes:
        node: the node that draws it.
        vertices: (m, 3) in scene coordinates.
        faces: (f, 3) into `vertices`.
        colors: (m, 4) linear RGBA in [0, 1], or None.
        uvs: (m, 2), or None.
        material: its slot among the materials read.
        weights: (m, n) of the scene's n nodes, rows sum to 1, or None without a skin.
        morphs: what its morph targets move.
    """

    node: int
    vertices: Array
    faces: NDArray[np.int64]
    colors: Array | None
    uvs: Array | None
    material: int
    weights: csr_array | None
    morphs: tuple[PartMorph, ...] = ()


def read_parts(
    file: GltfFile, scene: Scene, look: MaterialReader, morphs: MorphReader
) -> tuple[list[MeshPart], list[str]]:
    """Read every primitive of the default scene that has triangles; note the others.

    Raises:
        MeshError: an index, a count or a position is out of range, or there are too many.
    """
    parts: list[MeshPart] = []
    skipped = vertices = faces = 0
    for node in scene.drawn:
        entry = file.entry("nodes", node)
        if "mesh" not in entry:
            continue
        mesh = file.entry("meshes", entry.whole("mesh"))
        for primitive in mesh.children("primitives"):
            part = _read_part(file, scene, look, morphs, node, primitive)
            if part is None:
                skipped += 1
                continue
            parts.append(part)
            vertices, faces = vertices + len(part.vertices), faces + len(part.faces)
            if vertices > MOST_VERTICES or faces > MOST_FACES:
                raise MeshError(
                    f"it has more than {MOST_VERTICES} vertices or {MOST_FACES} faces; "
                    "reduce it first"
                )
    return parts, [f"{skipped} groups of points, lines or nothing left out"] if skipped else []


def _read_part(
    file: GltfFile,
    scene: Scene,
    look: MaterialReader,
    morphs: MorphReader,
    node: int,
    primitive: Entry,
) -> MeshPart | None:
    attributes = primitive.child("attributes") or Entry({}, primitive.place)
    mode = primitive.whole("mode", _TRIANGLES, below=7)
    if mode < _TRIANGLES or "POSITION" not in attributes:
        return None
    mesh = file.entry("meshes", file.entry("nodes", node).whole("mesh"))
    positions = _positions(file, primitive, attributes)
    positions = shaped(file, (file.entry("nodes", node), mesh), primitive, positions)
    faces = _faces(file, primitive, mode, len(positions))
    if not len(faces):
        return None
    weights = _weights(file, node, attributes, len(positions))
    if weights is None:
        to_scene = scene.to_scene[node][:3, :3]
        vertices = positions @ to_scene.T + scene.to_scene[node][:3, 3]
        if np.linalg.det(to_scene) < 0.0:
            faces = faces[:, ::-1]  # section 3.7.4: a mirrored node turns its triangles over
        by_node = None
    else:
        skin, on_joints = weights
        vertices, to_scene, by_node = _skinned(file, scene, skin, on_joints, positions)
        mirrored = np.linalg.det(to_scene)[faces].sum(axis=1) < 0.0
        faces = np.where(mirrored[:, None], faces[:, ::-1], faces)
    material = primitive.optional("material")
    return MeshPart(
        node,
        vertices,
        faces,
        _colors(file, attributes, len(positions)),
        _uvs(file, attributes, material, len(positions)),
        look.slot(material),
        by_node,
        morphs.read(file.entry("nodes", node).whole("mesh"), primitive, positions, to_scene),
    )


def _positions(file: GltfFile, primitive: Entry, attributes: Entry) -> Array:
    index = attributes.whole("POSITION")
    for name in COMPRESSIONS:
        if primitive.extension(name) is not None and (
            "bufferView" not in file.entry("accessors", index)
        ):
            raise compressed(name)
    _check_count(file, index, MOST_VERTICES, "vertices")
    positions = file.floats(index, "VEC3")
    if not (np.abs(positions) < 1e15).all():
        bad = int(np.flatnonzero(~(np.abs(positions) < 1e15).all(axis=1))[0])
        raise MeshError(
            f"vertex {bad} of {primitive.place} stands at no finite place; export the model again"
        )
    return positions


def _check_count(file: GltfFile, index: int, most: int, what: str) -> None:
    if file.count(index) > most:
        raise MeshError(f"it has {file.count(index)} {what}, more than {most}; reduce it first")


def _faces(file: GltfFile, primitive: Entry, mode: int, count: int) -> NDArray[np.int64]:
    index = primitive.optional("indices")
    if index is not None:
        _check_count(file, index, 3 * MOST_FACES, "indices")
    corners = np.arange(count) if index is None else file.wholes(index, "SCALAR")[:, 0]
    if len(corners) and corners.max() >= count:
        raise primitive.wrong(f"a triangle names vertex {corners.max()} of {count}")
    if mode == _TRIANGLES:
        if len(corners) % 3:
            raise primitive.wrong(f"{len(corners)} indices are no whole triangles")
        return corners.reshape(-1, 3)
    if len(corners) < 3:
        return np.empty((0, 3), dtype=np.int64)
    if mode == _FAN:
        hub = np.full(len(corners) - 2, corners[0])
        faces = np.column_stack([corners[1:-1], corners[2:], hub])
    else:
        turn = np.arange(len(corners) - 2) % 2  # every second triangle of a strip is turned over
        at = np.arange(len(corners) - 2)
        faces = corners[np.column_stack([at, at + 1 + turn, at + 2 - turn])]
    a, b, c = faces.T
    whole: NDArray[np.int64] = faces[
        (a != b) & (b != c) & (c != a)
    ]  # strips are stitched by flat triangles
    return whole


def _matching(file: GltfFile, attributes: Entry, name: str, count: int) -> int:
    """The index of an attribute's accessor, which must have as many elements as the positions."""
    index = attributes.whole(name)
    if file.count(index) != count:
        raise attributes.wrong(f"{name} has {file.count(index)} elements for {count} vertices")
    return index


def _colors(file: GltfFile, attributes: Entry, count: int) -> Array | None:
    if "COLOR_0" not in attributes:
        return None
    values = file.floats(_matching(file, attributes, "COLOR_0", count), "VEC3", "VEC4")
    colors = np.ones((count, 4))
    colors[:, : values.shape[1]] = np.clip(np.nan_to_num(values, nan=1.0), 0.0, 1.0)
    return colors


def _uvs(file: GltfFile, attributes: Entry, material: int | None, count: int) -> Array | None:
    name, place = texture_coordinates(file, material)
    if name not in attributes:
        return None
    values = file.floats(_matching(file, attributes, name, count), "VEC2")
    values = np.clip(np.nan_to_num(values, posinf=0.0, neginf=0.0), -1e6, 1e6)
    return values @ place[:, :2].T + place[:, 2]


def _weights(
    file: GltfFile, node: int, attributes: Entry, count: int
) -> tuple[Entry, csr_array] | None:
    """The node's skin and weights (count, k) of its k joints, or None if it has no skin."""
    index = file.entry("nodes", node).optional("skin")
    if index is None or "JOINTS_0" not in attributes or "WEIGHTS_0" not in attributes:
        return None
    skin = file.entry("skins", index)
    known = len(skin.wholes("joints", below=len(file.entries("nodes"))))
    if known == 0:
        raise skin.wrong("it has no joints")
    total = csr_array((count, known))
    for number in range(8):
        joints, weights = f"JOINTS_{number}", f"WEIGHTS_{number}"
        if joints not in attributes or weights not in attributes:
            break
        who = file.wholes(_matching(file, attributes, joints, count), *_SEVERAL)
        how_much = file.floats(_matching(file, attributes, weights, count), *_SEVERAL)
        if who.shape != how_much.shape:
            raise attributes.wrong(f"{joints} and {weights} name different numbers of joints")
        if not (np.abs(how_much) < 1e6).all():
            raise attributes.wrong("a skin weight is not a finite number")
        how_much = np.maximum(how_much, 0.0)
        if (who[how_much > 0.0] >= known).any():
            raise attributes.wrong(f"a vertex follows a joint beyond the {known} of its skin")
        rows = np.repeat(np.arange(count), who.shape[1])
        columns = np.minimum(who, known - 1).ravel()
        total = total + coo_array((how_much.ravel(), (rows, columns)), shape=(count, known)).tocsr()
    return skin, _normalized(csr_array(total))


def _normalized(weights: csr_array) -> csr_array:
    """Rows divided by their sums; a vertex without weight follows the first joint of its skin."""
    weights.eliminate_zeros()
    sums = weights.sum(axis=1)
    lost = np.flatnonzero(sums < 1e-9)
    scaled = weights.multiply(1.0 / np.maximum(sums, 1e-9)[:, None]).tocsr()
    kept = np.ones(len(sums))
    kept[lost] = 0.0
    first = coo_array((np.ones(len(lost)), (lost, np.zeros_like(lost))), shape=weights.shape)
    result = csr_array(scaled.multiply(kept[:, None]).tocsr() + first.tocsr())
    result.eliminate_zeros()
    return result


def _skinned(
    file: GltfFile, scene: Scene, skin: Entry, weights: csr_array, positions: Array
) -> tuple[Array, Array, csr_array]:
    """Vertices posed by linear blend skinning, how directions turn (m, 3, 3), weights (m, n)."""
    joints = skin.wholes("joints", below=len(file.entries("nodes")))
    to_joint = np.tile(np.eye(4), (len(joints), 1, 1))
    index = skin.optional("inverseBindMatrices")
    if index is not None:
        count = file.count(index)
        if not len(joints) <= count <= MOST_NODES:
            raise skin.wrong(f"it has {count} inverse bind matrices for {len(joints)} joints")
        to_joint = file.floats(index, "MAT4")[: len(joints)].reshape(-1, 4, 4).transpose(0, 2, 1)
    if not (np.abs(to_joint) < 1e15).all():
        raise skin.wrong("an inverse bind matrix is not finite")
    posing = (scene.to_scene[joints] @ to_joint)[:, :3]  # (k, 3, 4)
    blended = (weights @ posing.reshape(-1, 12)).reshape(-1, 3, 4)
    vertices = np.einsum("mij,mj->mi", blended[:, :, :3], positions) + blended[:, :, 3]
    node_of = coo_array(
        (np.ones(len(joints)), (np.arange(len(joints)), joints)),
        shape=(len(joints), len(scene.parents)),
    )
    return vertices, blended[:, :, :3], csr_array(weights @ node_of.tocsr())
