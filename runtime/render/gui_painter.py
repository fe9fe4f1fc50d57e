"""Draws the widgets of Dear ImGui over a picture."""

from __future__ import annotations

from ctypes import c_char

import moderngl
import numpy as np
from imgui_bundle import imgui

from runtime.render.programs import link, release_all

BLEND = (
    moderngl.SRC_ALPHA,
    moderngl.ONE_MINUS_SRC_ALPHA,
    moderngl.ONE,
    moderngl.ONE_MINUS_SRC_ALPHA,
)


class GuiPainter:
    """Draws what ImGui's current context lays out; keeps its textures, such as the letters.

    Args:
        context: the OpenGL context of this thread.
    """

    def __init__(self, context: moderngl.Context) -> None:
        self._context = context
        self._program = link(context, "gui", "gui")
        self._textures: dict[int, moderngl.Texture] = {}
        self._vertices = context.buffer(reserve=1 << 16, dynamic=True)
        self._indices = context.buffer(reserve=1 << 16, dynamic=True)
        self._array = self._bind()
        imgui.get_io().backend_flags |= imgui.BackendFlags_.renderer_has_textures
        most = context.info["GL_MAX_TEXTURE_SIZE"]
        platform = imgui.get_platform_io()
        platform.renderer_texture_max_width = platform.renderer_texture_max_height = most

    def draw(self, data: imgui.ImDrawData, target: moderngl.Framebuffer) -> None:
        """Draw the widgets over `target`, whose size [px] is that of ImGui's display."""
        for texture in imgui.get_platform_io().textures:
            self._keep(texture)
        width, height = target.size
        self._program["size"] = (width, height)
        target.use()
        self._context.enable_only(moderngl.BLEND)
        self._context.blend_func = BLEND  # type: ignore[assignment]  # its stub expects two
        for each in data.cmd_lists:
            self._upload(each)
            for command in each.cmd_buffer:
                left, top, right, bottom = (round(side) for side in command.clip_rect)
                left, top = max(left, 0), max(top, 0)
                if right <= left or bottom <= top or command.elem_count == 0:
                    continue
                box = (left, height - bottom, right - left, bottom - top)
                target.scissor = box
                self._textures[command.get_tex_id()].use(0)
                self._array.render(
                    moderngl.TRIANGLES, vertices=command.elem_count, first=command.idx_offset
                )
        target.scissor = None  # type: ignore[assignment]  # which its stub forgets
        self._context.enable_only(moderngl.NOTHING)
        self._context.blend_func = moderngl.DEFAULT_BLENDING  # type: ignore[assignment]  # its stub expects two

    def release(self) -> None:
        """Free the GL objects."""
        for texture in imgui.get_platform_io().textures:
            if texture.get_tex_id() in self._textures:
                texture.set_tex_id(0)
                texture.set_status(imgui.ImTextureStatus.destroyed)
        release_all(
            self._program, self._array, self._vertices, self._indices, *self._textures.values()
        )
        self._textures.clear()

    def _bind(self) -> moderngl.VertexArray:
        content = [(self._vertices, "2f4 2f4 4f1", "position", "corner", "tint")]
        return self._context.vertex_array(
            self._program, content, self._indices, index_element_size=imgui.INDEX_SIZE
        )

    def _upload(self, each: imgui.ImDrawList) -> None:
        """Upload the triangles of a list; the buffers grow with it."""
        parts = (
            (self._vertices, each.vtx_buffer, imgui.VERTEX_SIZE),
            (self._indices, each.idx_buffer, imgui.INDEX_SIZE),
        )
        for buffer, own, stride in parts:
            size = own.size() * stride
            if size > buffer.size:
                buffer.orphan(2 * size)
            else:
                buffer.orphan()
            buffer.write((c_char * size).from_address(own.data_address()))

    def _keep(self, texture: imgui.ImTextureData) -> None:
        """Make, change or free a texture, as ImGui asks for."""
        status = imgui.ImTextureStatus
        if texture.status == status.want_create:
            pixels = texture.get_pixels_array()
            size = (texture.width, texture.height)
            made = self._context.texture(size, texture.bytes_per_pixel, pixels.tobytes())
            made.repeat_x = made.repeat_y = False
            self._textures[made.glo] = made
            texture.set_tex_id(made.glo)
            texture.set_status(status.ok)
        elif texture.status == status.want_updates:
            pixels = texture.get_pixels_array().reshape(
                texture.height, texture.width, texture.bytes_per_pixel
            )
            own = self._textures[texture.get_tex_id()]
            for part in texture.updates:
                rows, columns = slice(part.y, part.y + part.h), slice(part.x, part.x + part.w)
                changed = np.ascontiguousarray(pixels[rows, columns])
                own.write(changed, (part.x, part.y, part.w, part.h))
            texture.set_status(status.ok)
        elif texture.status == status.want_destroy and texture.unused_frames > 0:
            self._textures.pop(texture.get_tex_id()).release()
            texture.set_tex_id(0)
            texture.set_status(status.destroyed)
