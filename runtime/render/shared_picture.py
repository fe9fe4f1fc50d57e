"""A picture that one OpenGL context draws and another one with shared objects shows."""

from __future__ import annotations

import moderngl

from runtime.render.programs import link, release_all
from runtime.render.stage import Stage


class SharedPicture:
    """A copy of a stage's picture, as a texture that other contexts can read.

    Args:
        context: the stage's context, current on this thread.
        size: width and height [px] of the picture.

    Attributes:
        image: the texture.
    """

    def __init__(self, context: moderngl.Context, size: tuple[int, int]) -> None:
        self._context = context
        self.image = context.texture(size, 4)
        self._target = context.framebuffer(self.image)

    def take(self, stage: Stage) -> None:
        """Copy a stage's picture; its size must be that of this one."""
        stage.show(self._target)
        self._context.finish()  # before the other context reads

    def release(self) -> None:
        """Free its GL objects; their context must be current."""
        release_all(self._target, self.image)


class PictureScreen:
    """Shows a shared picture in another context, as large as it fits, in the middle.

    Args:
        context: the other context, current on this thread.
    """

    def __init__(self, context: moderngl.Context) -> None:
        self._context = context
        self._program = link(context, "whole", "shared")
        self._array = context.vertex_array(self._program, [])

    def show(self, picture: SharedPicture, size: tuple[int, int]) -> None:
        """Draw a picture into the context's screen, of this size [px]; nothing beside it."""
        image = picture.image
        share = min(size[0] / image.width, size[1] / image.height)
        width, height = round(share * image.width), round(share * image.height)
        shared = self._context.external_texture(image.glo, image.size, 4, 0, "f1")
        screen = self._context.screen
        screen.use()
        screen.viewport = (0, 0, *size)
        screen.clear()
        screen.viewport = ((size[0] - width) // 2, (size[1] - height) // 2, width, height)
        self._context.disable(moderngl.BLEND)
        shared.use(0)
        self._array.render(moderngl.TRIANGLES, vertices=3)

    def release(self) -> None:
        """Free its GL objects; their context must be current."""
        release_all(self._array, self._program)
