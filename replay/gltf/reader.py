"""Read animations of glTF, GLB, VRM and VRMA files as recordings.

Source: Khronos, "glTF 2.0 Specification"; VRM Consortium, "VRMC_vrm_animation 1.0".
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from devices.blend_shapes import MOST_BLENDS, Blends, checked_blends
from devices.bodies.joint_labels import label_joints
from devices.printable import printable
from devices.skeleton import Skeleton
from replay.gltf.animation import PATHS, Animation, animations, check_size, chosen, listed
from replay.gltf.file import MOST_BYTES, GltfFile
from replay.gltf.humanoid import humanoid_bones
from replay.gltf.scene import Scene, local_transform, read_scene
from replay.orientation import body_height
from replay.recording import Recording
from replay.rigid_bones import as_matrices
from replay.stage_space import JointMotion, distinct, staged
from replay.stated import UNSTATED, Stated
from replay.text_file import file_bytes
from solvers.skeleton.quaternions import multiply

Array = NDArray[np.float64]

_SUFFIXES = (".glb", ".gltf", ".vrma", ".vrm")
_HEIGHTS = (0.5, 4.0)  # [m] of a body in glTF's own unit
_SIZES = (0.05, 12.0)  # [m] of one that has no height
_ALIKE = 1e-3  # of a scale: less is no shear
_MOVE = "translation"
_Y = np.array([0.0, 1.0, 0.0])


def recognises_gltf(path: Path, head: bytes) -> bool:
    """Whether a file is GLB, or JSON that says it is glTF."""
    if head[:4] == b"glTF":
        return True
    json = head.lstrip()[:1] == b"{"
    declared = b'"asset"' in head and (b'"nodes"' in head or b'"accessors"' in head)
    return json and (declared or path.suffix.lower() in _SUFFIXES)


def read_gltf_animation(path: Path, stated: Stated = UNSTATED) -> Recording:
    """Read an animation of a file, the first that moves: its skins' joints, or its moved nodes.

    A VRM animation has the bones of its humanoid, by VRM's names. Joints are sampled at the file's
    own even keys, else 60 times a second; rotations are joint to world. +Y is up and the metre the
    unit, unless the body would be no size of a body; expressions of VRM become blend shapes.

    Raises:
        InputError: it cannot be read.
        ContentError: it is damaged or compressed, or holds no motion, or not what is stated.
    """
    file = GltfFile(file_bytes(path, MOST_BYTES), path.parent)
    scene = read_scene(file)
    found = animations(file)
    played = chosen(found, stated.animation)
    notes: list[str] = []
    names = _joint_names(file, scene, played)
    times = played.times()
    nodes = _with_ancestors(scene, list(names))
    check_size(len(times), len(nodes))
    positions, rotations = _posed(file, scene, nodes, played, times)
    joints = list(names)
    at = np.array([nodes.index(node) for node in joints])
    motion = JointMotion(
        names=list(names.values()),
        parents=[_nearest(scene, node, joints) for node in joints],
        rest=scene.positions[joints],
        times=times,
        positions=positions[:, at],
        rotations=None if rotations is None else rotations[:, at],
        up=_Y,
    )
    recording = staged(replace(motion, metres=_metres(motion)), stated, notes)
    if len(found) > 1:
        others = listed(found, leave_out=played)
        said = f"{found.index(played) + 1} {printable(played.name)!r:.60}; by --animation-input: "
        recording = replace(recording, source={"animation": said + others})
    return _with_faces(recording, file, played, times)


def animations_in(path: Path) -> str:
    """The animations of a file in a line; "" for none.

    Raises:
        InputError: it cannot be read.
        ContentError: it is damaged.
    """
    return listed(animations(GltfFile(file_bytes(path, MOST_BYTES), path.parent)))


def _joint_names(file: GltfFile, scene: Scene, animation: Animation) -> dict[int, str]:
    """The name of each node that is a joint, parents first."""
    bones = {node: bone for bone, node in humanoid_bones(file).items()}
    moved = animation.nodes
    joints = set(bones)
    if joints.isdisjoint(moved):
        joints = set()
        for skin in file.entries("skins"):
            joints |= set(skin.wholes("joints", below=len(scene.parents)))
    if joints.isdisjoint(moved):
        tops = {n for n in moved if moved.isdisjoint(scene.ancestors(n))}
        joints = {
            node
            for node in range(len(scene.parents))
            if node in moved or not tops.isdisjoint(scene.ancestors(node))
        }
    nodes = file.entries("nodes")
    ordered = sorted(joints, key=lambda node: (len(scene.ancestors(node)), node))
    return {node: bones.get(node) or nodes[node].text("name", f"node {node}") for node in ordered}


def _with_ancestors(scene: Scene, joints: list[int]) -> list[int]:
    """The joints and all nodes above them, parents first."""
    needed = set(joints)
    for joint in joints:
        needed.update(scene.ancestors(joint))
    return sorted(needed, key=lambda node: (len(scene.ancestors(node)), node))


def _nearest(scene: Scene, node: int, joints: list[int]) -> int:
    """The place among the joints of the nearest one above a node; -1 for none."""
    return next((joints.index(above) for above in scene.ancestors(node) if above in joints), -1)


def _posed(
    file: GltfFile, scene: Scene, nodes: list[int], animation: Animation, times: Array
) -> tuple[Array, Array | None]:
    """World positions (T, N, 3) and rotations (T, N, 4) of the nodes.

    The rotations are None where scales shear or mirror, which leaves none.
    """
    entries = file.entries("nodes")
    place = {node: number for number, node in enumerate(nodes)}
    shape = (len(times), len(nodes))
    positions, rotations = np.empty((*shape, 3)), np.empty((*shape, 4))
    linear = np.empty((*shape, 3, 3))
    rigid = True
    for number, node in enumerate(nodes):
        move, turn, size = (
            animation.tracks[node, path].at(times) if (node, path) in animation.tracks else fixed
            for path, fixed in zip(PATHS, _parts(local_transform(entries[node])), strict=True)
        )
        rigid &= bool((size > 0.0).all())
        rigid &= bool((np.ptp(size, axis=-1) <= _ALIKE * np.abs(size).max(axis=-1)).all())
        own = _matrices(np.broadcast_to(turn, (len(times), 4))) * size[..., None, :]
        parent = int(scene.parents[node])
        if parent < 0:
            positions[:, number], rotations[:, number], linear[:, number] = move, turn, own
            continue
        above = place[parent]
        move = np.broadcast_to(move, (len(times), 3))
        carried = np.einsum("tij,tj->ti", linear[:, above], move)
        positions[:, number] = positions[:, above] + carried
        linear[:, number] = linear[:, above] @ own
        rotations[:, number] = multiply(rotations[:, above], turn)
    return positions, rotations if rigid else None


def _matrices(quaternions: Array) -> Array:
    """Matrices (T, 3, 3) of unit quaternions (T, 4); NaN where one is not finite."""
    known = np.isfinite(quaternions).all(axis=1)
    matrices = np.full((len(quaternions), 3, 3), np.nan)
    if known.any():
        matrices[known] = as_matrices(quaternions[known])
    return matrices


def _parts(matrix: Array) -> tuple[Array, Array, Array]:
    """Translation (3,), rotation (4,) and scale (3,) of a node's matrix without shear."""
    size = np.linalg.norm(matrix[:3, :3], axis=0)
    if np.linalg.det(matrix[:3, :3]) < 0.0:
        size[0] = -size[0]
    turn = matrix[:3, :3] / np.where(size == 0.0, 1.0, size)
    if not np.linalg.det(turn) > 0.0:
        return matrix[:3, 3], np.array([0.0, 0.0, 0.0, 1.0]), size
    quaternion: Array = Rotation.from_matrix(turn).as_quat()
    return matrix[:3, 3], quaternion, size


def _metres(motion: JointMotion) -> float | None:
    """1 if the body then has the size of one, else None."""
    if motion.rest.size and not np.ptp(motion.rest, axis=0).max() > 0.0:
        return 1.0
    parents = np.array(motion.parents)
    if np.count_nonzero(parents < 0) > 1:
        height = None
    else:
        skeleton = Skeleton(tuple(distinct(motion.names)), parents, motion.rest)
        height = body_height(skeleton, label_joints(skeleton), motion.rest)
    least, most = _SIZES if height is None else _HEIGHTS
    size = float(np.ptp(motion.rest, axis=0).max()) if height is None else height
    return 1.0 if least <= size <= most else None


def _with_faces(
    recording: Recording, file: GltfFile, animation: Animation, times: Array
) -> Recording:
    """The recording with the expressions of a VRM animation: the x of a node is a weight."""
    vrm = file.document.extension("VRMC_vrm_animation")
    expressions = None if vrm is None else vrm.child("expressions")
    weights: dict[str, Array] = {}
    for kind in ("preset", "custom"):
        named = None if expressions is None else expressions.child(kind)
        for name in () if named is None else list(named.fields)[:MOST_BLENDS]:
            entry = named.child(name) if named is not None else None
            track = None if entry is None else animation.tracks.get((entry.whole("node"), _MOVE))
            if track is not None:
                weights[name] = track.at(times)[:, 0]
    if not weights:
        return recording
    faces: tuple[Blends | None, ...] = tuple(
        checked_blends((name, float(row[frame])) for name, row in weights.items())
        for frame in range(len(times))
    )
    return replace(recording, blends=faces)
