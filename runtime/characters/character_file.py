"""Read characters from mesh and rig files: welded, placed on the stage, always with a skeleton."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array

from devices.errors import InputError
from devices.skeleton import Skeleton
from replay.foreign import conversion_hint
from runtime.characters.builtin import BUILTIN
from runtime.characters.cache import cached_skeleton
from runtime.characters.character import Character, Surface
from runtime.characters.file_to_stage import (
    ABOUT_FACE,
    UPRIGHT,
    file_to_stage_matrix,
    guess_rotation,
    placed,
)
from runtime.characters.formats.mesh_data import FileMesh, MeshError
from runtime.characters.formats.mesh_file import MESH_SUFFIXES, checked, read_mesh_file
from runtime.characters.gltf.rig import GltfModel, read_gltf
from runtime.characters.morphs import Morphs, welded_targets
from runtime.characters.palette import palette_color
from runtime.characters.weld import first_occurrences, weld, welded_weights

RIG_SUFFIXES = (".glb", ".gltf", ".vrm")
GOLDEN = (5.0**0.5 - 1.0) / 2.0
SUFFIXES = MESH_SUFFIXES + RIG_SUFFIXES


def read_character(path: Path) -> Character:
    """Read the character in a mesh or rig file, as the file has it, and place it on the stage.

    A file without a rig gets a skeleton extracted from its surface. `load_character` also knows
    built-in characters and prepares what it reads for performing.

    Raises:
        InputError: there is no such file, its format is not known, or it holds no usable surface.
    """
    if path.suffix.lower() not in SUFFIXES:
        if (hint := conversion_hint(path)) is not None:
            raise InputError(f"{path}: {hint}")
        raise InputError(
            f"{path}: no character is read from {path.suffix or 'a file without a suffix'}; use "
            f"{', '.join(SUFFIXES)}, or a built-in one: {', '.join(BUILTIN)}"
        )
    if not path.exists():
        raise InputError(
            f"{path}: there is no such file; built-in characters are {', '.join(BUILTIN)}"
        )
    return _from_rig(path) if path.suffix.lower() in RIG_SUFFIXES else _from_mesh(path)


def _from_mesh(path: Path) -> Character:
    mesh = read_mesh_file(path)
    vertex = weld(mesh.vertices)
    rotation, guesses = guess_rotation(mesh.vertices[first_occurrences(vertex)], vertex[mesh.faces])
    return _standing(path, replace(mesh, notes=mesh.notes + guesses), vertex, rotation)


def _from_rig(path: Path) -> Character:
    """glTF defines which way is up, VRM which way is forward: nothing is guessed."""
    model = read_gltf(path)
    mesh = FileMesh(
        model.file_vertices,
        model.faces,
        model.colors,
        model.uvs,
        model.materials,
        model.face_material,
        model.notes,
    )
    try:
        mesh = checked(mesh)
    except MeshError as error:
        raise InputError(f"{path}: {error}") from None
    rotation = ABOUT_FACE if model.faces_backward else UPRIGHT
    rig = None
    if model.skeleton is not None and model.weights is not None:
        rig = model.skeleton, model.weights
    vertex = weld(mesh.vertices, _mixture(model))
    character = _standing(path, mesh, vertex, rotation, rig)
    return replace(
        character, humanoid=model.humanoid, morphs=_morphs(model, vertex, character.file_to_stage)
    )


def _mixture(model: GltfModel) -> NDArray[np.float64] | None:
    """Moves (M, 3) of the vertices by a mixture of all morph targets; None without any.

    The weights are irrational multiples: two targets that differ do not cancel.
    """
    if not model.morphs:
        return None
    moves = np.zeros_like(model.file_vertices)
    for number, (vertices, deltas) in enumerate(model.morphs):
        np.add.at(moves, vertices, (0.5 + (number * GOLDEN) % 1.0) * deltas)
    return moves


def _morphs(
    model: GltfModel, vertex: NDArray[np.int64], file_to_stage: NDArray[np.float64]
) -> Morphs | None:
    if not model.morphs and not model.expressions:
        return None
    targets = welded_targets(model.morphs, vertex).turned(file_to_stage[:3, :3])
    return Morphs.of(targets, model.morph_names, model.expressions)


def _standing(
    path: Path,
    mesh: FileMesh,
    vertex: NDArray[np.int64],
    rotation: NDArray[np.float64],
    rig: tuple[Skeleton, csr_array] | None = None,
) -> Character:
    """Build the character on the stage; the rig holds the file's joints and weights (M, K)."""
    welded, faces = mesh.vertices[first_occurrences(vertex)], vertex[mesh.faces]
    file_to_stage = file_to_stage_matrix(rotation, welded[np.unique(faces)])
    vertices = placed(file_to_stage, welded)
    weights = None
    if rig is None:
        skeleton = _extracted(vertices, faces, path)
    else:
        joints, weights = rig[0], welded_weights(rig[1], vertex)
        skeleton = Skeleton(
            joints.names, joints.parents, placed(file_to_stage, joints.rest_positions)
        )
    return Character(
        name=path.stem,
        vertices=vertices,
        faces=faces,
        skeleton=skeleton,
        weights=weights,
        surface=_surface(mesh, vertex),
        file_to_stage=file_to_stage,
        notes=mesh.notes,
    )


def _extracted(vertices: NDArray[np.float64], faces: NDArray[np.int64], path: Path) -> Skeleton:
    from solvers.skeleton.skeletonize import VERSION, extract_skeleton  # noqa: PLC0415  # an optional extra

    try:
        parents, positions = cached_skeleton(vertices, faces, extract_skeleton, VERSION)
    except ImportError as error:
        raise InputError(
            f"{path}: a skeleton for a mesh without a rig needs the extra ({error.name}): "
            "pip install 'bunraku[characters]'"
        ) from None
    except OSError as error:  # PyGEL3D links libraries that a bare system lacks
        raise InputError(
            f"{path}: a skeleton for a mesh without a rig needs system libraries ({error}); "
            "on Debian or Ubuntu: apt-get install libgl1 libx11-6"
        ) from None
    names = tuple(f"node{index}" for index in range(len(parents)))
    return Skeleton(names, parents, positions)


def _surface(mesh: FileMesh, vertex: NDArray[np.int64]) -> Surface:
    colors = mesh.colors
    if colors is None:
        colors = np.ones((len(mesh.vertices), 4), dtype=np.float32)
        if all(m.texture is None and (m.color == 1.0).all() for m in mesh.materials):
            colors[:] = palette_color(mesh.vertices, mesh.faces)
    face_material = mesh.face_material
    if face_material is None:
        face_material = np.zeros(len(mesh.faces), dtype=np.int64)
    return Surface(
        vertex=vertex,
        faces=mesh.faces.astype(np.int32),
        colors=colors,
        uvs=mesh.uvs,
        materials=mesh.materials,
        face_material=face_material,
    )
