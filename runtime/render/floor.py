"""Shadows, contact shadows and reflections of the characters on the stage floor."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import moderngl
import numpy as np
from numpy.typing import NDArray

from runtime.render.frame import SHADOW_SIZE, Lighting
from runtime.render.programs import link, release_all
from runtime.render.stage_character import StageCharacter

MASK_SIZE = (320, 192)
HEIGHT_SIZE = (256, 256)
REFLECTION_REACH = 0.9  # how far in front of a character the floor still reflects it [m]


class ShadowMaps:
    """Depth maps of the characters: seen from the key light, and from below the floor."""

    def __init__(self, context: moderngl.Context) -> None:
        self.key = context.depth_texture((SHADOW_SIZE, SHADOW_SIZE))
        self.key.compare_func = "<="
        self.key.filter = (moderngl.LINEAR, moderngl.LINEAR)
        self.key.repeat_x = self.key.repeat_y = False
        self.height = context.depth_texture(HEIGHT_SIZE)
        self.height.compare_func = ""
        self.height.filter = (moderngl.LINEAR, moderngl.LINEAR)
        self.height.repeat_x = self.height.repeat_y = False
        self._key_target = context.framebuffer(depth_attachment=self.key)
        self._height_target = context.framebuffer(depth_attachment=self.height)

    def draw(self, characters: Sequence[StageCharacter], light: Lighting, *, contact: bool) -> None:
        """Draw the depth maps; the one from below only with `contact`, where there is a floor."""
        self._pass(self._key_target, characters, light.to_shadow_clip)
        if contact:
            self._pass(self._height_target, characters, light.to_height_clip)

    @staticmethod
    def _pass(
        target: moderngl.Framebuffer,
        characters: Sequence[StageCharacter],
        to_clip: NDArray[np.float64],
    ) -> None:
        target.use()
        target.clear(depth=1.0)
        for character in characters:
            character.draw_depth(to_clip)

    def release(self) -> None:
        """Free its GL objects."""
        release_all(self._key_target, self._height_target, self.key, self.height)


class Floor:
    """Draws shadows, contact shadows and reflections over the floor of the backdrop."""

    def __init__(self, context: moderngl.Context) -> None:
        self._context = context
        self._mask_program = link(context, "whole", "floor_mask")
        self._mask_program["shadow_map"] = 0
        self._mask_program["height_map"] = 1
        self._mask_array = context.vertex_array(self._mask_program, [])
        self._mask = context.texture(MASK_SIZE, 4)
        self._mask.repeat_x = self._mask.repeat_y = False
        self._mask_target = context.framebuffer(self._mask)
        self._program = link(context, "floor", "floor")
        self._program["floor_mask"] = 0
        self._program["reflection"] = 1
        self._program["reach"] = REFLECTION_REACH
        self._array = context.vertex_array(self._program, [])

    def draw_mask(self, maps: ShadowMaps) -> None:
        """Compute how much key light and ambient light reaches each point of the floor."""
        self._mask_target.use()
        maps.key.use(0)
        maps.height.use(1)
        self._mask_array.render(moderngl.TRIANGLES, vertices=3)

    def draw(self, target: moderngl.Framebuffer, reflection: moderngl.Texture) -> None:
        """Darken `target`, which holds the backdrop, and add the reflections to it."""
        target.use()
        self._mask.use(0)
        reflection.use(1)
        self._context.enable_only(moderngl.BLEND)
        add_and_keep: Any = (moderngl.ONE, moderngl.SRC_ALPHA, moderngl.ZERO, moderngl.ONE)
        self._context.blend_func = add_and_keep
        self._array.render(moderngl.TRIANGLE_STRIP, vertices=4)

    def release(self) -> None:
        """Free its GL objects."""
        release_all(self._array, self._program, self._mask_array, self._mask_program)
        release_all(self._mask_target, self._mask)
