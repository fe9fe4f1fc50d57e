"""One character on the stage: its vertex buffers, its materials, and its highlighted chains."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass

import moderngl
import numpy as np
from numpy.typing import ArrayLike, NDArray
from PIL import Image

from runtime.characters.character import Character, Material
from runtime.render.normals import (
    DeformingNormals,
    DrawVertices,
    bounding_box,
    is_closed,
    split_vertices,
)
from runtime.render.programs import release_all
from runtime.render.tubes import chain_tubes

SRGB8_ALPHA8 = 0x8C43
SAMPLE_ALPHA_TO_COVERAGE = 0x809E
SAMPLE_ALPHA_TO_ONE = 0x809F


@dataclass(frozen=True, slots=True, eq=False)
class CharacterPrograms:
    """The shader programs that draw characters; all characters on a stage share them."""

    depth: moderngl.Program
    plain: moderngl.Program
    textured: moderngl.Program
    reflection: moderngl.Program


@dataclass(frozen=True, slots=True, eq=False)
class _MaterialRun:
    """Consecutive triangles of one material."""

    first: int
    count: int
    tint: tuple[float, ...]
    reflection_tint: tuple[float, ...]
    image: moderngl.Texture | None
    see_through: bool


class StageCharacter:
    """A character as a stage draws it; `Stage.add` makes one.

    Attributes:
        character: what is drawn.
        caption: the text at its feet; empty for none.
        position: (3,) [m] the place of its origin on the stage.
        spot: (2,) [m] along x and z, how far its pool of light is from there.
    """

    def __init__(
        self,
        context: moderngl.Context,
        programs: CharacterPrograms,
        character: Character,
        position: ArrayLike,
        caption: str,
    ) -> None:
        self.character, self.caption = character, caption
        self.position = np.array(position, dtype=np.float64).reshape(3)
        self.spot = np.zeros(2)
        self._context = context
        self._programs = programs
        self._split = split_vertices(character)
        self._rest_shape = character.vertices.shape
        self._closed = is_closed(character.vertices, self._split.faces)
        self._normals = DeformingNormals(self._split)
        self._moving = context.buffer(reserve=24 * len(self._split.welded), dynamic=True)
        self._runs, self._order = _material_runs(context, character)
        self._constant = context.buffer(_constant_attributes(character, self._split))
        triangles = self._split.triangles[self._order]
        self._indices = context.buffer(triangles.tobytes() or bytes(12))
        self._arrays = self._vertex_arrays()
        self._tubes = chain_tubes([], [], 0.01)
        self.update(character.vertices)
        self.rest_box = self._box
        self._tube_radius = 0.012 * float(np.ptp(self.rest_box, axis=0).max())

    def _vertex_arrays(self) -> dict[str, moderngl.VertexArray]:
        position = (self._moving, "3f 12x", "in_position")
        whole = (self._moving, "3f 3f", "in_position", "in_normal")
        colour = (self._constant, "4f 8x", "in_colour")
        image = (self._constant, "4f 2f", "in_colour", "in_uv")
        buffers = {
            "depth": [position],
            "plain": [whole, colour],
            "reflection": [whole, colour],
            "textured": [whole, image],
        }
        return {
            name: self._context.vertex_array(getattr(self._programs, name), content, self._indices)
            for name, content in buffers.items()
        }

    def update(self, vertices: NDArray[np.float64]) -> None:
        """Upload the deformed welded vertices (N, 3) [m], in the character's coordinates.

        Raises:
            ValueError: the shape is not that of the character's vertices.
        """
        if vertices.shape != self._rest_shape:
            raise ValueError(
                f"Expected `vertices` to have shape {self._rest_shape}, got {vertices.shape}"
            )
        vertices = np.ascontiguousarray(vertices, dtype=np.float64)
        self._moving.orphan()  # new storage: the write does not wait for draws from the old one
        self._moving.write(self._normals.fill(vertices))
        self._box = bounding_box(vertices)

    def highlight(
        self, chains: Sequence[ArrayLike], colours: ArrayLike, widths: ArrayLike = 1.0
    ) -> None:
        """Highlight polylines inside the surface; they show through it. An empty list removes them.

        Args:
            chains: each (K, 3) [m], in the character's coordinates.
            colours: (C, 3) linear RGB of each chain.
            widths: times the usual width, of all or (C,) of each chain.

        Raises:
            ValueError: the number of colours is not the number of chains.
        """
        radii = self._tube_radius * np.asarray(widths, dtype=np.float64)
        self._tubes = chain_tubes(chains, colours, radii)

    @property
    def tubes(self) -> NDArray[np.float32]:
        """The highlighted chains as capsules (K, 13), in the character's coordinates."""
        return self._tubes

    @property
    def box(self) -> NDArray[np.float64]:
        """(2, 3) [m] least and greatest corner of its current vertices on the stage."""
        return self._box + self.position

    @property
    def pool(self) -> NDArray[np.float64]:
        """(3,) x, z and radius [m] of its pool of light on the floor."""
        low, high = self.rest_box + self.position
        half = (high - low)[[0, 2]] / 2.0
        centre = (low + high)[[0, 2]] / 2.0
        return np.array([*(centre + self.spot), max(0.62, float(half.max()) + 0.38)])

    def draw_depth(self, to_clip: NDArray[np.float64]) -> None:
        """Draw into a depth map; `to_clip` (4, 4) maps world coordinates to its clip space."""
        self._programs.depth["to_clip"] = tuple(to_clip.T.ravel())
        self._programs.depth["offset"] = tuple(self.position)
        with _culling(self._context, self._closed):
            self._arrays["depth"].render()

    def draw_reflection(self) -> None:
        """Draw the upside-down image that the floor reflects."""
        program = self._programs.reflection
        program["offset"] = tuple(self.position)
        self._context.front_face = "cw"  # a reflection reverses the winding of every triangle
        for run in self._runs:
            program["tint"] = run.reflection_tint
            with _culling(self._context, self._closed and not run.see_through):
                self._arrays["reflection"].render(vertices=run.count, first=run.first)
        self._context.front_face = "ccw"

    def draw(self) -> None:
        """Draw the lit surface."""
        for run in self._runs:
            name = "plain" if run.image is None else "textured"
            program = getattr(self._programs, name)
            program["offset"] = tuple(self.position)
            program["tint"] = run.tint
            if run.image is not None:
                run.image.use(1)
            with (
                _coverage(self._context, run.see_through),
                _culling(self._context, self._closed and not run.see_through),
            ):
                self._arrays[name].render(vertices=run.count, first=run.first)

    def release(self) -> None:
        """Free its GL objects."""
        release_all(*self._arrays.values(), self._moving, self._constant, self._indices)
        release_all(*(run.image for run in self._runs))


@dataclass(frozen=True, slots=True, eq=False)
class GhostLayer:
    """Doubles that are drawn as one; they hide one another, and cast no shadow.

    Attributes:
        doubles: made by `Stage.double`.
        colour: encoded sRGB.
        opacity: in [0, 1].
    """

    doubles: Sequence[StageCharacter]
    colour: tuple[float, float, float]
    opacity: float


@contextmanager
def _culling(context: moderngl.Context, wanted: bool) -> Iterator[None]:
    """Skip triangles that face away: half the work where no inside can be seen."""
    if wanted:
        context.enable(moderngl.CULL_FACE)
    yield
    if wanted:
        context.disable(moderngl.CULL_FACE)


@contextmanager
def _coverage(context: moderngl.Context, wanted: bool) -> Iterator[None]:
    """Turn alpha into sample coverage: translucent surfaces need no sorting."""
    states = (SAMPLE_ALPHA_TO_COVERAGE, SAMPLE_ALPHA_TO_ONE) if wanted else ()
    for state in states:
        context.enable_direct(state)
    yield
    for state in states:
        context.disable_direct(state)


def _constant_attributes(character: Character, split: DrawVertices) -> bytes:
    surface = character.surface
    attributes = np.zeros((max(len(split.file), 1), 6), dtype=np.float32)
    attributes[: len(split.file), :4] = surface.colors[split.file]
    if surface.uvs is not None:
        attributes[: len(split.file), 4:] = surface.uvs[split.file]
    return attributes.tobytes()


def _material_runs(
    context: moderngl.Context, character: Character
) -> tuple[list[_MaterialRun], NDArray[np.int64]]:
    """One run of triangles for each used material, and the face order (F,) that groups them."""
    surface = character.surface
    order = np.argsort(surface.face_material, kind="stable")
    used, first, count = np.unique(
        surface.face_material[order], return_index=True, return_counts=True
    )
    faint = bool((surface.colors[:, 3] < 0.999).any())
    runs = []
    for index, start, faces in zip(used, first, count, strict=True):
        material = surface.materials[index]
        texture = material.texture if surface.uvs is not None else None
        mean = np.ones(4)
        see_through = faint or material.color[3] < 0.999
        if texture is not None:
            mean = _linear(np.asarray(texture)[::4, ::4].reshape(-1, 4)).mean(axis=0)
            see_through |= bool((texture[..., 3] < 255).any())
        runs.append(
            _MaterialRun(
                first=int(start) * 3,
                count=int(faces) * 3,
                tint=tuple(material.color.tolist()),
                reflection_tint=tuple((material.color * mean).tolist()),
                image=None if texture is None else _image(context, material),
                see_through=bool(see_through),
            )
        )
    return runs, order


def _linear(colours: NDArray[np.uint8]) -> NDArray[np.float64]:
    encoded = colours / 255.0
    linear: NDArray[np.float64] = np.where(
        encoded <= 0.04045, encoded / 12.92, ((encoded + 0.055) / 1.055) ** 2.4
    )
    linear[..., 3] = encoded[..., 3]
    return linear


def _image(context: moderngl.Context, material: Material) -> moderngl.Texture:
    picture = Image.fromarray(np.ascontiguousarray(material.texture))
    largest = min(int(context.info["GL_MAX_TEXTURE_SIZE"]), 4096)
    picture.thumbnail((largest, largest))
    texture = context.texture(picture.size, 4, picture.tobytes(), internal_format=SRGB8_ALPHA8)
    texture.build_mipmaps()
    texture.filter = (moderngl.LINEAR_MIPMAP_LINEAR, moderngl.LINEAR)
    return texture
