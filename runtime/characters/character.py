"""The type of a character: a surface to deform, a skeleton to match, and its look."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array

from devices.bodies.body_plan import BodyPlan
from devices.skeleton import Skeleton
from runtime.characters.morphs import Morphs


@dataclass(frozen=True, slots=True, eq=False)
class Material:
    """The colour and texture of some faces.

    Attributes:
        color: (4,) linear RGBA in [0, 1]; multiplies texture and vertex colours.
        texture: (h, w, 4) uint8 sRGB image, first row at v = 0 as glTF has it, or None.
    """

    color: NDArray[np.float32]
    texture: NDArray[np.uint8] | None = None


@dataclass(frozen=True, slots=True, eq=False)
class Surface:
    """The surface with seams split as in its file, for drawing and for the point cache.

    Attributes:
        vertex: (M,) int; index of each file vertex in the welded character, in file order.
        faces: (F, 3) int32 into the M file vertices, in the same order as the character's faces.
        colors: (M, 4) float32 linear RGBA in [0, 1].
        uvs: (M, 2) float32 texture coordinates, or None.
        materials: at least one.
        face_material: (F,) int into `materials`.
    """

    vertex: NDArray[np.int64]
    faces: NDArray[np.int32]
    colors: NDArray[np.float32]
    uvs: NDArray[np.float32] | None
    materials: tuple[Material, ...]
    face_material: NDArray[np.int64]


@dataclass(frozen=True, slots=True, eq=False)
class Body:
    """Nodes by which a body is driven limb by limb.

    Attributes:
        skeleton: the nodes at rest, on the stage.
        plan: the parts of the body, of these nodes.
    """

    skeleton: Skeleton
    plan: BodyPlan


@dataclass(frozen=True, slots=True, eq=False)
class Character:
    """A character in its rest pose on the stage: metres, +Y up, facing +Z, standing on y = 0.

    Attributes:
        name: for people.
        vertices: (N, 3) [m] welded rest positions.
        faces: (F, 3) int64 into `vertices`; may have boundaries, several components, degenerate
            triangles and non-manifold edges.
        skeleton: its nodes as a tree, from the file's rig or extracted from the surface.
        weights: (N, K) skin weights of the file's rig, rows sum to 1, or None.
        surface: for drawing.
        file_to_stage: (4, 4) takes file coordinates to stage coordinates: rotation, uniform scale,
            translation.
        humanoid: nodes that the file declares to be bones of a humanoid, by VRM's names for them.
        plan: the parts of its body, of the skeleton's nodes; None where no body is recognised.
        notes: guesses and repairs, one short line each.
        morphs: what blend shapes can move; None where the file has no morph targets.
        body: other nodes for driving it limb by limb than those of the skeleton; None for none.
    """

    name: str
    vertices: NDArray[np.float64]
    faces: NDArray[np.int64]
    skeleton: Skeleton
    weights: csr_array | None
    surface: Surface
    file_to_stage: NDArray[np.float64]
    humanoid: Mapping[str, int] = field(default_factory=dict)
    plan: BodyPlan | None = None
    notes: tuple[str, ...] = ()
    morphs: Morphs | None = None
    body: Body | None = None

    @property
    def limb_by_limb(self) -> Character:
        """The character with the nodes by which it is driven limb by limb."""
        if self.body is None:
            return self
        return replace(self, skeleton=self.body.skeleton, plan=self.body.plan, body=None)

    def in_file_coordinates(self, vertices: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return file vertices (M, 3) in the file's frame for deformed welded vertices (N, 3)."""
        to_file = np.asarray(np.linalg.inv(self.file_to_stage), dtype=np.float64)
        placed: NDArray[np.float64] = vertices[self.surface.vertex] @ to_file[:3, :3].T
        return placed + to_file[:3, 3]
