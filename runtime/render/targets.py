"""The framebuffers that a picture of one size is drawn through."""

from __future__ import annotations

import moderngl

from runtime.render.programs import release_all


class Targets:
    """Framebuffers of one size.

    Attributes:
        actors: multisampled colour and depth; cleared to nothing, premultiplied.
        resolved: the same, one sample a pixel.
        backdrop: the house without actors, kept while camera and pools stand still.
        reflection: the actors upside down, half as wide and high.
        picture: what is read or shown, premultiplied.
    """

    def __init__(self, context: moderngl.Context, size: tuple[int, int], samples: int) -> None:
        half = (max(size[0] // 2, 1), max(size[1] // 2, 1))
        self.size = size
        self._context = context
        self.resolved_image = context.texture(size, 4)
        self.reflection_image = context.texture(half, 4)
        self.reflection_image.repeat_x = self.reflection_image.repeat_y = False
        self.actors = context.framebuffer(
            context.renderbuffer(size, 4, samples=samples),
            context.depth_renderbuffer(size, samples=samples),
        )
        self.resolved = context.framebuffer(self.resolved_image)
        self.backdrop = context.framebuffer(context.renderbuffer(size, 4))
        self.reflection = context.framebuffer(
            self.reflection_image, context.depth_renderbuffer(half)
        )
        self.picture = context.framebuffer(context.renderbuffer(size, 4))

    def release(self) -> None:
        """Free the framebuffers and all that is attached to them."""
        # moderngl goes back to the framebuffer in use after it makes another: let it be one that
        # outlives these.
        self._context.detect_framebuffer(0).use()
        for target in (self.actors, self.resolved, self.backdrop, self.reflection, self.picture):
            release_all(target, *target.color_attachments, target.depth_attachment)
