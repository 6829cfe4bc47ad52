"""A pass is one draw call and one sentence: which program, what it reads, which values, where it draws.

    Pass(gpu, "render/surfaces").draw(target, textures={"t_normal": n}, uniforms={"u_time": 3}, vertices=6, instances=tiles)

Everything binds by name, checked both ways: a name that the program lacks, or one that was not given, raises.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import moderngl
import numpy as np
from numpy.typing import NDArray

from app.gpu.context import Gpu
from app.gpu.shader import FULLSCREEN, Glsl, ShaderError
from app.gpu.timers import NOT_TIMED

GL_CLIP_DISTANCE0 = 0x3000
ONE_SHAPE = 4  # vertices, at most, of a triangle or of a strip of two
BLEND: dict[str, Any] = {
    "add": (moderngl.ONE, moderngl.ONE),
    "multiply": (moderngl.ZERO, moderngl.SRC_COLOR),
    "keep": (moderngl.ONE, moderngl.SRC_ALPHA),
    "over": (moderngl.SRC_ALPHA, moderngl.ONE_MINUS_SRC_ALPHA, moderngl.ONE, moderngl.ONE_MINUS_SRC_ALPHA),
}


class Pass:
    """A program with its defines and slots, ready to draw. The name is also its label in the timers, without ``solvers/``."""

    def __init__(
        self,
        gpu: Gpu,
        name: str,
        *,
        defines: Mapping[str, object] | None = None,
        slots: Mapping[str, str | Glsl] | None = None,
        vertex: str = FULLSCREEN,
        label: str | None = None,
    ) -> None:
        """vertex: the vertex shader, where the program has none of its own."""
        self.gpu, self.name, self.label, self._vertex = gpu, name, label or name.removeprefix("solvers/"), vertex
        self._defines, self._slots = dict(defines or {}), dict(slots or {})
        self._generation = -1
        self._bind()

    def _bind(self) -> None:
        self.program = self.gpu.shaders.program(self.name, self._defines, self._slots, self._vertex)
        self._generation = self.gpu.shaders.generation
        members: dict[str, Any] = {n: self.program[n] for n in self.program}
        self._blocks = {n: m for n, m in members.items() if isinstance(m, moderngl.UniformBlock)}
        for binding, block in enumerate(self._blocks.values()):
            block.binding = binding
        members = {n: m for n, m in members.items() if isinstance(m, moderngl.Uniform)}
        # GL types of samplers are the only ones that are bound to a unit
        self._samplers = {n: i for i, n in enumerate(sorted(n for n in members if n.startswith("t_")))}
        self._uniforms = {n: u for n, u in members.items() if not n.startswith("t_")}
        for name, unit in self._samplers.items():
            members[name].value = unit

    def draw(
        self,
        target: moderngl.Framebuffer,
        *,
        textures: Mapping[str, moderngl.Texture] | None = None,
        uniforms: Mapping[str, Any] | None = None,
        blocks: Mapping[str, tuple[moderngl.Buffer, int, int]] | None = None,
        mesh: Mesh | None = None,
        vertices: int = 3,
        instances: int = 1,
        viewport: tuple[int, int, int, int] | None = None,
        scissor: tuple[int, int, int, int] | None = None,
        blend: str | None = None,
        depth: bool = False,
        strip: bool = False,
        points: bool = False,
        clip_distances: int = 0,
    ) -> None:
        """Draw once into ``target``. Without a mesh, ``vertices`` without attributes. A block is (buffer, offset, size in bytes).
        Raises ShaderError on a wrong name."""
        if self._generation != self.gpu.shaders.generation:
            self._bind()
        self._check("texture", textures or {}, self._samplers)
        self._check("uniform", uniforms or {}, self._uniforms)
        self._check("block", blocks or {}, self._blocks)
        for name, (buffer, offset, size) in (blocks or {}).items():
            buffer.bind_to_uniform_block(self._blocks[name].binding, offset=offset, size=size)
        for name, texture in (textures or {}).items():
            texture.use(self._samplers[name])
        for name, value in (uniforms or {}).items():
            self._uniforms[name].value = value
        ctx = self.gpu.ctx
        if self.gpu.compiling:
            vertices, instances, scissor = min(vertices, ONE_SHAPE), 1, (0, 0, 1, 1)
        target.use()
        target.viewport = viewport or (0, 0, *target.size)
        if scissor:
            target.scissor = scissor
        flags = (moderngl.BLEND if blend else 0) | (moderngl.DEPTH_TEST if depth else 0)
        ctx.enable_only(flags)
        if blend:
            ctx.blend_func = BLEND[blend]
        mode = moderngl.POINTS if points else moderngl.TRIANGLE_STRIP if strip else moderngl.TRIANGLES
        for plane in range(clip_distances):
            ctx.enable_direct(GL_CLIP_DISTANCE0 + plane)
        with NOT_TIMED if self.gpu.compiling else self.gpu.timers.measure(self.label):
            if mesh is None:
                array = self.gpu.shaders.attributeless(self.program)
                array.render(mode, vertices=vertices, instances=instances)
            else:
                array = mesh.vertex_array(self.program)
                if mesh.per_instance:
                    count = min(mesh.count, 1) if self.gpu.compiling else mesh.count
                    array.render(moderngl.TRIANGLE_STRIP, vertices=4, instances=count)
                else:
                    count = min(mesh.drawn, ONE_SHAPE) if self.gpu.compiling else mesh.drawn
                    array.render(mode, vertices=count, instances=instances)
        if scissor:  # or later clears would keep it
            target.scissor = None  # type: ignore[assignment]  # None is no scissor; moderngl's stub is wrong
        for plane in range(clip_distances):
            ctx.disable_direct(GL_CLIP_DISTANCE0 + plane)

    def _check(self, kind: str, given: Mapping[str, Any], known: Mapping[str, Any]) -> None:
        if given.keys() == known.keys():
            return
        if unknown := given.keys() - known.keys():
            raise ShaderError(f"pass {self.name} has no {kind} {', '.join(sorted(unknown))}")
        if missing := known.keys() - given.keys():
            raise ShaderError(f"pass {self.name} needs {kind} {', '.join(sorted(missing))}")


class Mesh:
    """An interleaved vertex buffer: ``attributes`` maps names to moderngl formats (``3f``, ``2u``), in order. With
    ``per_instance`` one element is one instance of a quad, which the vertex shader makes from ``gl_VertexID`` 0 to 3.
    ``indices`` are u32."""

    def __init__(
        self,
        gpu: Gpu,
        data: bytes,
        attributes: Mapping[str, str],
        *,
        per_instance: bool = False,
        indices: bytes | None = None,
    ) -> None:
        self._ctx, self._shaders = gpu.ctx, gpu.shaders
        self.buffer = gpu.ctx.buffer(data)
        self.attributes = dict(attributes)
        self.per_instance = per_instance
        self._indices = None if indices is None else gpu.ctx.buffer(indices)
        self.count = len(data) // sum(int(f[0]) * 4 for f in attributes.values())
        self.drawn = self.count if indices is None else len(indices) // 4  # vertices, or indices
        self._arrays: list[tuple[moderngl.Program, moderngl.VertexArray]] = []
        self._generation = gpu.shaders.generation

    def vertex_array(self, program: moderngl.Program) -> moderngl.VertexArray:
        """This mesh as ``program`` reads it; attributes that it does not use are skipped. Raises ShaderError."""
        if self._generation != self._shaders.generation:  # the programs of the others are gone
            self._release_arrays()
            self._generation = self._shaders.generation
        for known, array in self._arrays:
            if known is program:
                return array
        wanted = {n for n in program if isinstance(program[n], moderngl.Attribute) and not n.startswith("gl_")}
        if missing := wanted - set(self.attributes):
            raise ShaderError(f"mesh has no attribute {', '.join(sorted(missing))}")
        layout = " ".join(f if n in wanted else f"{int(f[0]) * 4}x" for n, f in self.attributes.items())
        layout += " /i" if self.per_instance else ""
        names = [n for n in self.attributes if n in wanted]
        array = self._ctx.vertex_array(program, [(self.buffer, layout, *names)], index_buffer=self._indices)
        self._arrays.append((program, array))
        return array

    def choose(self, indices: NDArray[np.uint32]) -> None:
        """Draw these from now on, at most as many as there were at first."""
        assert self._indices is not None
        self._indices.orphan()  # what is being drawn keeps its own
        self._indices.write(indices)
        self.drawn = indices.size

    def _release_arrays(self) -> None:
        for _, array in self._arrays:
            array.release()
        self._arrays.clear()

    def release(self) -> None:
        self._release_arrays()
        self.buffer.release()
        if self._indices is not None:
            self._indices.release()
