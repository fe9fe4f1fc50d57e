"""The framebuffers of all render passes for a picture of one size."""

from __future__ import annotations

import moderngl

from runtime.render.programs import release_all


class Framebuffers:
    """Framebuffers of one size.

    Attributes:
        characters: the characters, multisampled colour and depth; cleared to transparent,
            premultiplied.
        resolved: the same with one sample a pixel.
        backdrop: floor and curtain without characters; kept while camera and pools stay the same.
        reflection: the characters upside down, at half the width and height.
        picture: the finished picture, premultiplied.
    """

    def __init__(self, context: moderngl.Context, size: tuple[int, int], samples: int) -> None:
        half = (max(size[0] // 2, 1), max(size[1] // 2, 1))
        self.size = size
        self._context = context
        self.resolved_image = context.texture(size, 4)
        self.reflection_image = context.texture(half, 4)
        self.reflection_image.repeat_x = self.reflection_image.repeat_y = False
        self.characters = context.framebuffer(
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
        """Free the framebuffers and their attachments."""
        # moderngl binds the framebuffer in use again after it makes another one, so bind one that
        # outlives these.
        self._context.detect_framebuffer(0).use()
        for target in (
            self.characters,
            self.resolved,
            self.backdrop,
            self.reflection,
            self.picture,
        ):
            release_all(target, *target.color_attachments, target.depth_attachment)
