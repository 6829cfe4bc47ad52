"""Draws Dear ImGui (1.92 or newer) into any framebuffer; the window and headless shots use the same code.

Dear ImGui owns the pixels of its textures (font atlas) and asks for them to be made, updated and given back; other
textures are shown by ``texture_id``. Everything goes to the GPU in one vertex and one index buffer per frame.
"""

from __future__ import annotations

import ctypes

import moderngl
import numpy as np
from imgui_bundle import imgui
from numpy.typing import NDArray

from app.gpu.context import Gpu
from app.gpu.passes import BLEND

LABEL = "imgui"  # of the timer
VERTEX_LAYOUT = "2f 2f 4f1"  # position, uv, colour: ImDrawVert
GROWTH = 1.5  # buffers grow by this factor, so that they seldom grow


class ImguiRenderer:
    """Renders the draw data of the Dear ImGui context that is current when this is made.

    Leaves viewport, blending and textures as they were last used: every pass sets its own. Whoever makes it releases
    it, before the Dear ImGui context is destroyed.
    """

    def __init__(self, gpu: Gpu) -> None:
        assert imgui.get_current_context() is not None
        assert (imgui.VERTEX_SIZE, imgui.INDEX_SIZE) == (20, 4)
        self._gpu = gpu
        self._own: dict[int, moderngl.Texture] = {}
        self._shown: dict[int, moderngl.Texture] = {}
        self._vertices = gpu.ctx.buffer(reserve=1 << 16, dynamic=True)
        self._indices = gpu.ctx.buffer(reserve=1 << 16, dynamic=True)
        self._array: moderngl.VertexArray | None = None
        self._generation = -1
        self._io = imgui.get_io()
        self._platform = imgui.get_platform_io()
        self._io.backend_flags |= (
            imgui.BackendFlags_.renderer_has_textures | imgui.BackendFlags_.renderer_has_vtx_offset
        )
        self._platform.renderer_texture_max_width = gpu.limits.max_texture
        self._platform.renderer_texture_max_height = gpu.limits.max_texture

    def texture_id(self, texture: moderngl.Texture) -> int:
        """A number for ``imgui.ImTextureRef``, good until the next ``draw``. The texture is sampled as it is set."""
        self._shown[texture.glo] = texture
        return texture.glo

    def draw(self, target: moderngl.Framebuffer, data: imgui.ImDrawData) -> None:
        """Draw ``data`` over ``target``, whose size is the data's display size times its framebuffer scale [px]."""
        for texture in self._platform.textures:
            if texture.status != imgui.ImTextureStatus.ok:
                self._update(texture)
        if data.display_size.x > 0 and data.display_size.y > 0 and data.total_vtx_count > 0:
            with self._gpu.timers.measure(LABEL):
                self._draw_lists(target, data)
        self._shown.clear()

    def release(self) -> None:
        """Give back every GL object and tell Dear ImGui that its textures are gone."""
        for texture in self._platform.textures:
            if texture.tex_id:
                self._destroy(texture)
        self._io.backend_flags &= ~int(imgui.BackendFlags_.renderer_has_textures)
        array = () if self._array is None else (self._array,)
        self._gpu.release_all(*array, self._vertices, self._indices)
        self._shown.clear()

    # -- textures that Dear ImGui owns ---------------------------------------------------------------------------------

    def _update(self, data: imgui.ImTextureData) -> None:
        if data.status == imgui.ImTextureStatus.want_create:
            assert data.format == imgui.ImTextureFormat.rgba32
            texture = self._gpu.texture((data.width, data.height), 4, "f1", data.get_pixels_array().tobytes())
            texture.filter = (moderngl.LINEAR, moderngl.LINEAR)  # lines are baked into the atlas for bilinear look-ups
            self._own[texture.glo] = texture
            data.set_tex_id(texture.glo)
            data.set_status(imgui.ImTextureStatus.ok)
        elif data.status == imgui.ImTextureStatus.want_updates:
            pixels = data.get_pixels_array().reshape(data.height, data.width, 4)
            for rect in data.updates:
                block = pixels[rect.y : rect.y + rect.h, rect.x : rect.x + rect.w]
                self._own[data.tex_id].write(block.tobytes(), viewport=(rect.x, rect.y, rect.w, rect.h), alignment=1)
            data.set_status(imgui.ImTextureStatus.ok)
        elif data.status == imgui.ImTextureStatus.want_destroy and data.unused_frames > 0:
            self._destroy(data)

    def _destroy(self, data: imgui.ImTextureData) -> None:
        self._gpu.release_all(self._own.pop(data.tex_id))
        data.set_tex_id(0)
        data.set_status(imgui.ImTextureStatus.destroyed)

    # -- draw lists ----------------------------------------------------------------------------------------------------

    def _draw_lists(self, target: moderngl.Framebuffer, data: imgui.ImDrawData) -> None:
        array = self._upload(data)
        origin, scale = data.display_pos, data.framebuffer_scale
        width, height = round(data.display_size.x * scale.x), round(data.display_size.y * scale.y)
        target.use()
        target.viewport = (0, 0, width, height)
        self._gpu.ctx.enable_only(moderngl.BLEND)
        self._gpu.ctx.blend_func = BLEND["over"]
        first = 0
        for draw_list in data.cmd_lists:
            for command in draw_list.cmd_buffer:
                clip = command.clip_rect
                left, right = (max(0, round((x - origin.x) * scale.x)) for x in (clip.x, clip.z))
                top, bottom = (max(0, round((y - origin.y) * scale.y)) for y in (clip.y, clip.w))
                right, bottom = min(right, width), min(bottom, height)
                if right > left and bottom > top and command.elem_count:
                    target.scissor = (left, height - bottom, right - left, bottom - top)
                    identity = command.tex_ref.get_tex_id()
                    (self._own.get(identity) or self._shown[identity]).use(0)
                    array.render(moderngl.TRIANGLES, vertices=command.elem_count, first=first + command.idx_offset)
            first += draw_list.idx_buffer.size()
        target.scissor = None  # type: ignore[assignment]  # None is no scissor; moderngl's stub is wrong

    def _upload(self, data: imgui.ImDrawData) -> moderngl.VertexArray:
        """All lists' vertices and indices, end to end, in two buffers; the array that reads them."""
        vertices, indices = [], []
        base = 0
        for draw_list in data.cmd_lists:
            vertex, index = draw_list.vtx_buffer, draw_list.idx_buffer
            vertices.append(ctypes.string_at(vertex.data_address(), vertex.size() * imgui.VERTEX_SIZE))
            numbers = np.frombuffer(ctypes.string_at(index.data_address(), index.size() * imgui.INDEX_SIZE), np.uint32)
            indices.append(_rebased(numbers, draw_list, base))
            base += vertex.size()
        program = self._gpu.shaders.program("imgui/draw")
        buffers = self._vertices, self._indices
        self._vertices = self._filled(self._vertices, b"".join(vertices))
        self._indices = self._filled(self._indices, np.concatenate(indices).tobytes())
        stale = buffers != (self._vertices, self._indices) or self._generation != self._gpu.shaders.generation
        if self._array is None or stale:
            if self._array is not None:
                self._gpu.release_all(self._array)
            content = [(self._vertices, VERTEX_LAYOUT, "in_position", "in_uv", "in_colour")]
            self._array = self._gpu.ctx.vertex_array(program, content, index_buffer=self._indices)
            self._generation = self._gpu.shaders.generation
        size, origin = data.display_size, data.display_pos
        sx, sy = 2.0 / size.x, -2.0 / size.y
        program["u_clip_from_display"].value = (sx, sy, -1.0 - origin.x * sx, 1.0 - origin.y * sy)  # type: ignore[union-attr]
        return self._array

    def _filled(self, buffer: moderngl.Buffer, content: bytes) -> moderngl.Buffer:
        """``buffer`` with other content, or a larger one in its place."""
        if buffer.size < len(content):
            self._gpu.release_all(buffer)
            buffer = self._gpu.ctx.buffer(reserve=int(len(content) * GROWTH), dynamic=True)
        else:
            buffer.orphan()
        buffer.write(content)
        return buffer


def _rebased(indices: NDArray[np.uint32], draw_list: imgui.ImDrawList, base: int) -> NDArray[np.uint32]:
    """Indices into the shared vertex buffer, in which this list starts at ``base``."""
    out = indices + np.uint32(base)
    for command in draw_list.cmd_buffer:
        if command.vtx_offset:
            out[command.idx_offset : command.idx_offset + command.elem_count] += np.uint32(command.vtx_offset)
    return out
