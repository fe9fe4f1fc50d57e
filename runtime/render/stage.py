"""The stage: draws characters on a lit floor in front of a curtain, or on a plain background."""

from __future__ import annotations

from collections.abc import Sequence

import moderngl
import numpy as np
from numpy.typing import ArrayLike, NDArray

from devices.errors import InputError
from runtime.characters.character import Character
from runtime.render.background import Background
from runtime.render.camera import Camera
from runtime.render.caption import CaptionPainter
from runtime.render.floor import Floor, ShadowMaps
from runtime.render.frame import (
    FRAME,
    MAX_POOLS,
    Lighting,
    StageSet,
    covered,
    frame_block,
    lighting,
    stage_set,
)
from runtime.render.framebuffers import Framebuffers
from runtime.render.inset import InsetPainter, SkeletonInset
from runtime.render.programs import FRAME_BINDING, link, release_all
from runtime.render.stage_character import CharacterPrograms, GhostLayer, StageCharacter
from runtime.render.tubes import TubePainter

CLIP_DISTANCE0 = 0x3000
WASH = 0.65  # how much of a ghost's own colour is replaced
OVER = (moderngl.ONE, moderngl.ONE_MINUS_SRC_ALPHA)
UNDER = (moderngl.ONE_MINUS_DST_ALPHA, moderngl.ONE)
DIM = (moderngl.ZERO, moderngl.SRC_ALPHA)


class Stage:
    """Draws characters into a framebuffer, for a window and for files alike.

    The passes: shadow and contact maps; backdrop and floor; ghosts and then the characters, each
    with multisampling; chains, captions and inset; all over one another, in sRGB. The backdrop is
    kept while the camera and the pools of light stay the same.

    Args:
        context: an OpenGL 3.3 context, current on this thread.
        size: width and height of the picture [px].
        samples: samples a pixel at the characters' edges; limited to the driver's maximum.
        background: a plain background instead of floor and curtain; `read` returns its alpha.

    Attributes:
        brightness: from 1 to 0. At 0 the picture is black; with a plain background it is the
            background alone, so that a keyed picture shows no characters.
    """

    def __init__(
        self,
        context: moderngl.Context,
        size: tuple[int, int],
        *,
        samples: int = 4,
        background: Background | None = None,
    ) -> None:
        self.brightness = 1.0
        self._context = context
        self._samples = min(samples, context.max_samples)
        self._background = background
        self._characters: list[StageCharacter] = []
        self._doubles: list[StageCharacter] = []
        self._programs = CharacterPrograms(
            depth=link(context, "depth", "depth"),
            plain=link(context, "character", "character"),
            textured=link(context, "character", "character", defines=("TEXTURED",)),
            reflection=link(context, "character", "reflection"),
        )
        self._programs.textured["image"] = 1
        self._maps = ShadowMaps(context)
        self._floor = Floor(context)
        self._tubes = TubePainter(context)
        self._inset = InsetPainter(context)
        self._caption = CaptionPainter(context)
        self._backdrop_program = link(context, "whole", "backdrop")
        self._backdrop_array = context.vertex_array(self._backdrop_program, [])
        self._lay_program = link(context, "whole", "resolved")
        self._lay_array = context.vertex_array(self._lay_program, [])
        self._ghost_program = link(context, "whole", "ghost")
        self._ghost_array = context.vertex_array(self._ghost_program, [])
        self._fill_program = link(context, "whole", "fill")
        self._fill_array = context.vertex_array(self._fill_program, [])
        self._frame = context.buffer(reserve=FRAME.itemsize, dynamic=True)
        self._reflected_frame = context.buffer(reserve=FRAME.itemsize, dynamic=True)
        self._framebuffers = self._make_framebuffers(size)
        self._kept_backdrop = b""
        self._seen = (0, 0, *size)

    def _make_framebuffers(self, size: tuple[int, int]) -> Framebuffers:
        largest = min(int(self._context.info["GL_MAX_TEXTURE_SIZE"]), 16384)
        if not (0 < size[0] <= largest and 0 < size[1] <= largest):
            raise InputError(
                f"a picture of {size[0]}x{size[1]} pixels cannot be drawn here; "
                f"choose a --size from 1x1 to {largest}x{largest}"
            )
        return Framebuffers(self._context, (int(size[0]), int(size[1])), self._samples)

    @property
    def size(self) -> tuple[int, int]:
        """Width and height of the picture [px]."""
        return self._framebuffers.size

    @property
    def aspect(self) -> float:
        """Width over height."""
        return self.size[0] / self.size[1]

    @property
    def boxes(self) -> NDArray[np.float64]:
        """(A, 2, 3) [m] the bounding box of each character now: least and greatest corner."""
        return np.array([character.box for character in self._characters]).reshape(-1, 2, 3)

    def add(
        self,
        character: Character,
        *,
        position: ArrayLike = (0.0, 0.0, 0.0),
        caption: str = "",
    ) -> StageCharacter:
        """Put a character in its rest pose on the stage, with its own pool of light.

        Args:
            character: the character to draw.
            position: (3,) [m] the place of its origin.
            caption: a text at its feet; empty for none.

        Raises:
            InputError: the stage has its maximum number of characters.
        """
        if len(self._characters) == MAX_POOLS:
            raise InputError(f"a stage holds {MAX_POOLS} characters at most")
        added = StageCharacter(self._context, self._programs, character, position, caption)
        self._characters.append(added)
        return added

    def double(self, original: StageCharacter) -> StageCharacter:
        """Return a double of a character on the stage, for ghosts; freed with the stage."""
        double = StageCharacter(
            self._context, self._programs, original.character, original.position, ""
        )
        self._doubles.append(double)
        return double

    def remove(self, character: StageCharacter) -> None:
        """Remove a character and free its GL objects."""
        self._characters.remove(character)
        character.release()

    def resize(self, size: tuple[int, int]) -> None:
        """Change the size of the picture [px]."""
        if tuple(size) != self.size:
            self._framebuffers.release()
            self._framebuffers = self._make_framebuffers(size)
            self._kept_backdrop = b""

    def draw(
        self,
        camera: Camera,
        inset: SkeletonInset | None = None,
        around: StageSet | None = None,
        ghosts: Sequence[GhostLayer] = (),
    ) -> None:
        """Draw the characters as they are now.

        Args:
            camera: sees them.
            inset: shows the performer.
            around: the curtain; round the pools of light if None.
            ghosts: are seen behind the characters; the first ones furthest behind.
        """
        light = lighting(self.boxes if self._characters else _EMPTY)
        pools = (
            np.array([character.pool for character in self._characters])
            if self._characters
            else _NO_POOLS
        )
        around = around or stage_set(pools[:, :2])
        boxes = [each.box for layer in ghosts for each in layer.doubles]
        self._seen = covered(
            camera, self.size, np.concatenate([self.boxes, *(b[None] for b in boxes)])
        )
        self._share(camera, light, pools, around)
        self._context.enable_only(moderngl.DEPTH_TEST)
        self._maps.draw(self._characters, light, contact=self._background is None)
        if self._background is None:
            self._draw_floor_and_curtain(repr((camera, around)).encode() + pools.tobytes())
        else:
            self._framebuffers.picture.clear()
        for layer in ghosts:
            self._draw_characters(layer.doubles, light)
            self._ghost_program["wash"] = (*layer.colour, WASH)
            self._ghost_program["opacity"] = layer.opacity
            self._lay(self._ghost_array)
        self._draw_characters(self._characters, light)
        self._lay(self._lay_array)
        self._draw_over(camera, inset)
        if self.brightness < 1.0:
            self._fill(DIM, (0.0, 0.0, 0.0, max(self.brightness, 0.0)))
        if self._background is not None and self._background.alpha > 0:
            self._fill(UNDER, self._background.premultiplied)

    def _share(
        self, camera: Camera, light: Lighting, pools: NDArray[np.float64], around: StageSet
    ) -> None:
        for buffer, reflected in ((self._frame, False), (self._reflected_frame, True)):
            block = frame_block(
                camera,
                self.size,
                light,
                pools,
                around,
                on_floor=self._background is None,
                reflected=reflected,
            )
            buffer.orphan()
            buffer.write(block.tobytes())
        self._frame.bind_to_uniform_block(FRAME_BINDING)

    def _draw_characters(self, characters: Sequence[StageCharacter], light: Lighting) -> None:
        self._context.enable_only(moderngl.DEPTH_TEST)
        for program in (self._programs.plain, self._programs.textured):
            program["shadow_texel"] = 1.8 * light.texel
        self._maps.key.use(0)
        self._framebuffers.characters.use()
        self._framebuffers.characters.clear(viewport=self._seen)
        self._context.enable_direct(CLIP_DISTANCE0)
        for character in characters:
            character.draw()
        self._context.disable_direct(CLIP_DISTANCE0)
        self._framebuffers.resolved.scissor = self._seen
        self._framebuffers.resolved.use()
        self._context.copy_framebuffer(self._framebuffers.resolved, self._framebuffers.characters)

    def _draw_floor_and_curtain(self, wanted: bytes) -> None:
        """Draw the floor and the curtain; `wanted` tells one backdrop from another."""
        self._reflected_frame.bind_to_uniform_block(FRAME_BINDING)
        self._framebuffers.reflection.use()
        self._framebuffers.reflection.clear()
        self._context.enable_direct(CLIP_DISTANCE0)
        for character in self._characters:
            character.draw_reflection()
        self._context.disable_direct(CLIP_DISTANCE0)
        self._frame.bind_to_uniform_block(FRAME_BINDING)
        self._context.disable(moderngl.DEPTH_TEST)
        if wanted != self._kept_backdrop:
            self._framebuffers.backdrop.use()
            self._backdrop_array.render(moderngl.TRIANGLES, vertices=3)
            self._kept_backdrop = wanted
        self._context.copy_framebuffer(self._framebuffers.picture, self._framebuffers.backdrop)
        self._floor.draw_mask(self._maps)
        self._floor.draw(self._framebuffers.picture, self._framebuffers.reflection_image)

    def _lay(self, array: moderngl.VertexArray) -> None:
        """Lay what was resolved over the picture, as the program of an array does."""
        picture = self._framebuffers.picture
        picture.use()
        self._context.enable_only(moderngl.BLEND)
        self._context.blend_func = OVER
        self._framebuffers.resolved_image.use(0)
        picture.scissor = self._seen
        array.render(moderngl.TRIANGLES, vertices=3)
        picture.scissor = (0, 0, *self.size)

    def _draw_over(self, camera: Camera, inset: SkeletonInset | None) -> None:
        """Draw chains, captions and inset over the picture."""
        height = self.size[1]
        to_clip = camera.projection(self.aspect) @ camera.view
        pixels = height / (2.0 * np.tan(camera.fov / 2.0))
        for character in self._characters:
            self._tubes.draw(
                character.tubes, to_clip, size=self.size, pixels=pixels, offset=character.position
            )
        self._draw_captions(to_clip)
        if inset is not None:
            self._inset.draw(inset, self._tubes, self._framebuffers.picture)

    def _fill(
        self, blend: tuple[int, int], premultiplied: tuple[float, float, float, float]
    ) -> None:
        """Blend one colour into the whole picture."""
        self._framebuffers.picture.use()
        self._context.enable_only(moderngl.BLEND)
        self._context.blend_func = blend
        self._fill_program["premultiplied"] = premultiplied
        self._fill_array.render(moderngl.TRIANGLES, vertices=3)

    def _draw_captions(self, to_clip: NDArray[np.float64]) -> None:
        for character in self._characters:
            if character.caption:
                depth = max(other.rest_box[1, 2] for other in self._characters)
                near = character.position[2] + character.spot[1] + depth + 0.16
                foot = to_clip @ [character.pool[0], 0.0, near, 1.0]
                at = (foot[:2] / foot[3] * 0.5 + 0.5) * self.size
                self._caption.draw(
                    character.caption, (float(at[0]), float(at[1])), self._framebuffers.picture
                )

    def show(self, target: moderngl.Framebuffer) -> None:
        """Copy the picture to a framebuffer of the same size, such as a window's."""
        self._context.copy_framebuffer(target, self._framebuffers.picture)

    def read(self) -> NDArray[np.uint8]:
        """Return the picture (H, W, 4): sRGB with straight alpha, top row first."""
        width, height = self.size
        data = self._framebuffers.picture.read(components=4, alignment=1)
        pixels = np.frombuffer(data, dtype=np.uint8).reshape(height, width, 4)[::-1].copy()
        if self._background is None or self._background.alpha == 255:
            pixels[..., 3] = 255
            return pixels
        alpha = pixels[..., 3:].astype(np.uint16)
        straight = (pixels[..., :3] * np.uint16(255) + alpha // 2) // np.maximum(alpha, 1)
        pixels[..., :3] = np.minimum(straight, 255)
        return pixels

    def release(self) -> None:
        """Free all GL objects; the stage cannot be used afterwards."""
        for character in list(self._characters):
            self.remove(character)
        release_all(*self._doubles, self._ghost_array, self._ghost_program)
        release_all(self._framebuffers, self._maps, self._floor, self._tubes, self._inset)
        release_all(self._caption, self._backdrop_array, self._backdrop_program)
        release_all(self._lay_array, self._lay_program, self._fill_array, self._fill_program)
        release_all(self._frame, self._reflected_frame)
        programs = self._programs
        release_all(programs.depth, programs.plain, programs.textured, programs.reflection)


_EMPTY = np.array([[[-0.5, 0.0, -0.5], [0.5, 1.5, 0.5]]])
_NO_POOLS = np.array([[0.0, 0.0, 0.9]])
