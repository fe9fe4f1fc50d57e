"""Export of a performed character as an animated, skinned .glb."""

from __future__ import annotations

from contextlib import closing
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from devices.errors import InputError
from runtime.characters.character import Character, Material, Surface
from runtime.output.files.glb import ARRAY_BUFFER, ELEMENT_ARRAY_BUFFER, GlbBuilder
from runtime.output.files.kept_file import counting, millimetres
from runtime.output.files.morph_export import MorphExport, MovedShapes
from runtime.output.files.node_motion import NodeMotion, NodeMotionRecorder
from runtime.output.files.surface_correction import Correction, SurfaceFile, correct
from runtime.output.files.whole_file import check_suffix, check_writable
from runtime.output.output import PerformedFrame
from solvers.surface.skin_weights import (
    INFLUENCES,
    PosedSamples,
    Skin,
    deviations,
    fit_skin,
    skin_of_distances,
    skin_of_weights,
)

_SAMPLES = 64  # most frames that the skin is fitted to
_STILL = 1e-6  # of the character's size: smaller motion needs no channel
_FINEST = 1e-6  # of the character's size: files hold numbers of 24 bits
_ROUGHNESS = 0.8  # cloth and paint, like the puppets on our own stage


@dataclass(frozen=True, slots=True)
class SkinDeviation:
    """Distance between the surface of the file and the performed one.

    Attributes:
        rms: root mean square over the vertices, of the sampled frames for a skin alone [m].
        greatest: maximum over the same vertices [m].
    """

    rms: float
    greatest: float


class GltfExport:
    """Writes mesh, materials, skeleton, skin and animation, on the stage: metres, +Y up.

    The animation moves the skeleton's nodes, which every game engine plays. The surface follows by
    linear blend skinning with four nodes per vertex, which approximates the performed surface. The
    weights come from the character's file, or are fitted to up to 64 frames of the show.
    Morph targets that the show moved are written with their weights, by the same way as the nodes.
    With `within`, corrective morph targets bring every vertex of every frame that near to where it
    was performed: as few as do. `deviation` measures the error; the file has it too, in the mesh's
    ``extras``. The point cache and the USD export hold the exact surface.

    The file is written at the end, in one piece.

    Attributes:
        deviation: None before `close`, and in a show without frames.

    Args:
        path: ends in .glb.
        character: the performed character.
        within: how far a vertex may be from the performed surface, as a share of the character's
            height; None for the skin alone.

    Raises:
        InputError: the suffix is not .glb, or the file cannot be written.
    """

    pictures_a_second = 0.0

    def __init__(self, path: Path, character: Character, *, within: float | None = None) -> None:
        check_suffix(path, (".glb",))
        check_writable(path)
        self._path, self._character = path, character
        self._motion = NodeMotionRecorder(len(character.skeleton.names))
        self._morphs = MorphExport(character)
        self._samples: list[PerformedFrame] = []
        self._stride = 1  # frames per kept sample
        self._written = 0
        self._within = within
        self._surfaces = SurfaceFile(path, len(character.vertices)) if within is not None else None
        self._correction: Correction | None = None
        self._closed = False
        self.deviation: SkinDeviation | None = None

    def write(self, frame: PerformedFrame) -> None:
        """Store one frame.

        Raises:
            InputError: the disk fails; then no file is written.
        """
        if self._motion.add(frame):
            self._morphs.add(frame)
            if self._surfaces is not None:
                try:
                    self._surfaces.write(frame.vertices)
                except InputError:
                    self._closed = True
                    self._surfaces.close()
                    raise
        if self._written % self._stride == 0:
            self._samples.append(replace(frame, vertices=frame.vertices.copy(), picture=None))
            if len(self._samples) > _SAMPLES:
                self._samples = self._samples[::2]
                self._stride *= 2
        self._written += 1

    def close(self) -> None:
        """Fit the skin and write the file; a show without frames gives the rest pose.

        Raises:
            InputError: the disk fails.
        """
        if self._closed:
            return
        self._closed = True
        skin, motion = self._fitted_skin(), self._motion.motion()
        if self._surfaces is not None:
            with closing(self._surfaces):
                skin = self._corrected(skin, motion, self._surfaces)
        builder = GlbBuilder()
        shapes = MovedShapes(builder, self._character, self._morphs, self._correction)
        _add_skeleton(builder, self._character)
        _add_mesh(builder, self._character, skin, self.deviation, shapes)
        _add_animation(builder, self._character, motion, shapes)
        builder.save(self._path)

    @property
    def error(self) -> str:
        """How far the skinned surface is from the performed one, in words; empty before `close`."""
        off = self.deviation
        if off is None:
            return ""
        if self._correction is not None:
            count = len(self._correction.targets)
            return (
                f"within {millimetres(off.greatest)} mm of the performed surface, by a skin and "
                f"{counting(count, 'corrective shape')}"
            )
        return (
            f"skinned {millimetres(off.rms)} mm from the performed surface (RMS), "
            f"{millimetres(off.greatest)} mm at most"
        )

    def _fitted_skin(self) -> Skin:
        vertices, tree = self._character.vertices, self._character.skeleton.tree
        frames = self._samples
        nodes = [frame.nodes_for("a skinned .glb") for frame in frames]
        samples = PosedSamples(
            np.array([frame.vertices for frame in frames]).reshape(-1, *vertices.shape),
            np.array([posed.positions for posed in nodes]),
            np.array([posed.rotations for posed in nodes]),
        )
        if self._character.weights is not None:
            skin = skin_of_weights(self._character.weights)
        else:
            prior = skin_of_distances(vertices, tree)
            skin = fit_skin(vertices, tree, prior, self._morphs.undone(samples, frames, prior))
        if frames:
            off = deviations(vertices, tree, skin, self._morphs.undone(samples, frames, skin))
            self.deviation = SkinDeviation(float(np.sqrt(np.mean(off**2))), float(off.max()))
        return skin

    def _corrected(self, skin: Skin, motion: NodeMotion, surfaces: SurfaceFile) -> Skin:
        """Find what corrects the skin; return the skin that is corrected."""
        assert self._within is not None
        vertices, frames = self._character.vertices, len(motion.times)
        size, height = np.ptp(vertices, axis=0).max(), np.ptp(vertices[:, 1])
        with closing(SurfaceFile(self._path, len(vertices))) as wanted:
            self._correction = found = correct(
                vertices,
                self._character.skeleton.tree,
                skin,
                motion,
                surfaces.surfaces(frames),
                wanted,
                max(self._within * float(height), _FINEST * float(size)),
                self._morphs.deltas_at,
            )
        self.deviation = SkinDeviation(found.rms, found.greatest) if frames else None
        return found.skin

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *exc: object) -> None:
        self.close()


def _add_skeleton(builder: GlbBuilder, character: Character) -> None:
    """Add nodes 0 to K - 1 for the skeleton, node K for the mesh, and skin 0 that binds them."""
    skeleton = character.skeleton
    rest = skeleton.rest_positions
    nodes: list[dict[str, Any]] = []
    for node, (name, parent) in enumerate(zip(skeleton.names, skeleton.parents, strict=True)):
        offset = rest[node] - (rest[parent] if parent >= 0 else 0.0)
        item: dict[str, Any] = {"name": name, "translation": offset.tolist()}
        children = np.flatnonzero(skeleton.parents == node).tolist()
        nodes.append(item | ({"children": children} if children else {}))
    nodes.append({"name": character.name, "mesh": 0, "skin": 0})
    inverse_bind = np.tile(np.eye(4, dtype=np.float32), (len(rest), 1, 1))
    inverse_bind[:, :3, 3] = -rest
    builder.document |= {
        "nodes": nodes,
        "scenes": [{"nodes": [skeleton.root, len(rest)]}],
        "scene": 0,
        "skins": [
            {
                "joints": list(range(len(rest))),
                "skeleton": skeleton.root,
                "inverseBindMatrices": builder.add_array(inverse_bind),
            }
        ],
    }


def _add_mesh(
    builder: GlbBuilder,
    character: Character,
    skin: Skin,
    deviation: SkinDeviation | None,
    shapes: MovedShapes,
) -> None:
    """Add one primitive for each material in use; all share the same vertices."""
    surface = character.surface
    attributes, targets = _attributes(builder, character, skin), shapes.targets
    primitives: list[dict[str, Any]] = []
    materials: list[dict[str, Any]] = []
    for material in np.unique(surface.face_material):
        corners = surface.faces[surface.face_material == material].astype(np.uint32).ravel()
        primitives.append(
            {
                "attributes": attributes,
                "indices": builder.add_array(corners, target=ELEMENT_ARRAY_BUFFER),
                "material": len(materials),
            }
            | ({"targets": targets} if targets else {})
        )
        materials.append(_material(builder, surface, surface.materials[material]))
    mesh: dict[str, Any] = {"name": character.name, "primitives": primitives}
    extras: dict[str, Any] = {}
    if deviation is not None:
        extras = {
            "skinDeviationRms": deviation.rms,
            "skinDeviationGreatest": deviation.greatest,
        }
    if targets:
        mesh["weights"] = [0.0] * len(targets)
        extras["targetNames"] = shapes.names
    if extras:
        mesh["extras"] = extras
    builder.document |= {"meshes": [mesh], "materials": materials}


def _attributes(builder: GlbBuilder, character: Character, skin: Skin) -> dict[str, int]:
    surface = character.surface

    def add(values: NDArray[Any], dtype: type, **options: bool) -> int:
        return builder.add_array(values.astype(dtype), target=ARRAY_BUFFER, **options)

    normals = _vertex_normals(character.vertices, character.faces)
    nodes, weights = _four_influences(skin)
    attributes = {
        "POSITION": add(character.vertices[surface.vertex], np.float32, bounds=True),
        "NORMAL": add(normals[surface.vertex], np.float32),
        "JOINTS_0": add(nodes[surface.vertex], np.uint16),
        "WEIGHTS_0": add(weights[surface.vertex], np.float32),
    }
    colors = np.clip(np.nan_to_num(surface.colors, nan=1.0), 0.0, 1.0)
    if not (colors == 1.0).all():
        attributes["COLOR_0"] = add(np.rint(65535 * colors), np.uint16, normalized=True)
    if surface.uvs is not None:
        attributes["TEXCOORD_0"] = add(np.nan_to_num(surface.uvs), np.float32)
    return attributes


def _four_influences(skin: Skin) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Return nodes and weights (N, 4); a node without weight is 0, as glTF requires."""
    padding = ((0, 0), (0, INFLUENCES - skin.nodes.shape[1]))
    weights = np.pad(skin.weights, padding)
    return np.where(weights > 0, np.pad(skin.nodes, padding), 0), weights


def _material(builder: GlbBuilder, surface: Surface, material: Material) -> dict[str, Any]:
    color = np.clip(np.nan_to_num(material.color, nan=1.0), 0.0, 1.0)
    look: dict[str, Any] = {
        "baseColorFactor": color.tolist(),
        "metallicFactor": 0.0,
        "roughnessFactor": _ROUGHNESS,
    }
    if material.texture is not None and surface.uvs is not None:
        look["baseColorTexture"] = {"index": builder.add_texture(material.texture)}
    # The surface may be open: both sides are drawn, as on our own stage.
    described: dict[str, Any] = {"pbrMetallicRoughness": look, "doubleSided": True}
    return described | ({"alphaMode": "BLEND"} if color[3] < 1 else {})


def _add_animation(
    builder: GlbBuilder, character: Character, motion: NodeMotion, shapes: MovedShapes
) -> None:
    """Add channels only for motion: a bone that keeps its length has no translation channel."""
    if len(motion.times) == 0:
        return
    skeleton = character.skeleton
    rest = skeleton.rest_positions
    still = _STILL * float(np.ptp(character.vertices, axis=0).max())
    translations, rotations = motion.local(skeleton)
    samplers: list[dict[str, Any]] = []
    channels: list[dict[str, Any]] = []
    times = builder.add_array(motion.times.astype(np.float32), bounds=True)

    def add(node: int, path: str, values: NDArray[np.floating]) -> None:
        output = builder.add_array(values.astype(np.float32))
        channels.append({"sampler": len(samplers), "target": {"node": node, "path": path}})
        samplers.append({"input": times, "output": output, "interpolation": "LINEAR"})

    for node, parent in enumerate(skeleton.parents.tolist()):
        offset = rest[node] - (rest[parent] if parent >= 0 else 0.0)
        if np.abs(translations[:, node] - offset).max() > still:
            add(node, "translation", translations[:, node])
        if np.abs(rotations[:, node, :3]).max() > _STILL:
            add(node, "rotation", rotations[:, node])
    weights = shapes.weights
    if weights.size:
        add(len(rest), "weights", weights.ravel())
    if channels:
        animation = {"name": "performance", "samplers": samplers, "channels": channels}
        builder.document["animations"] = [animation]


def _vertex_normals(vertices: NDArray[np.float64], faces: NDArray[np.int64]) -> NDArray[np.float64]:
    """Return unit normals (N, 3), weighted by area; +Y for a vertex without a face."""
    a, b, c = (vertices[faces[:, corner]] for corner in range(3))
    areas = np.cross(b - a, c - a)
    normals = np.zeros_like(vertices)
    for corner in range(3):
        np.add.at(normals, faces[:, corner], areas)
    lengths = np.linalg.norm(normals, axis=1, keepdims=True)
    unit: NDArray[np.float64] = np.divide(
        normals, lengths, out=np.tile([0.0, 1.0, 0.0], (len(vertices), 1)), where=lengths > 0
    )
    return unit
