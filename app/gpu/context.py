"""The OpenGL context and what it can do. ``Gpu`` is passed to whoever draws; nothing is global."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import moderngl

from app.errors import GpuError
from app.gpu.shader import ShaderLibrary
from app.gpu.timers import Timers

GL_REQUIRED = 410  # macOS stops at OpenGL 4.1
EGL_HINT = "install a driver with EGL (Debian: apt-get install libegl1 libgl1-mesa-dri) and run 'glowtree doctor'"


@dataclass(frozen=True)
class Limits:
    """What the context allows."""

    vendor: str
    renderer: str
    version: str
    gl: int  # 410 = OpenGL 4.1
    max_texture: int  # texels along an edge
    compute: bool  # 4.3 or ARB_compute_shader: for gathering and matrix solvers only


class Gpu:
    """A context with its shader library and pass timers. compiling: whether passes draw only so that programs are compiled.

    Raises GpuError when the context is older than OpenGL 4.1.
    """

    def __init__(self, ctx: moderngl.Context) -> None:
        self.ctx = ctx
        info = ctx.info
        self.limits = Limits(
            vendor=str(info["GL_VENDOR"]),
            renderer=str(info["GL_RENDERER"]),
            version=str(info["GL_VERSION"]),
            gl=ctx.version_code,
            max_texture=int(info["GL_MAX_TEXTURE_SIZE"]),
            compute=ctx.version_code >= 430 or "GL_ARB_compute_shader" in ctx.extensions,
        )
        if ctx.version_code < GL_REQUIRED:
            raise GpuError(f"OpenGL {ctx.version_code / 100:.1f} on {self.limits.renderer}: 4.1 or newer is needed")
        self.shaders = ShaderLibrary(ctx)
        self.timers = Timers(ctx)
        self.compiling = False

    @property
    def software(self) -> bool:
        """Whether a CPU rasterises: goldens are compared only then."""
        return "llvmpipe" in self.limits.renderer

    def texture(self, size: tuple[int, int], components: int, dtype: str, data: Any = None) -> moderngl.Texture:
        """An unfiltered 2-D texture; dtype as in moderngl (``f4``, ``f2``, ``f1``, ``u4``). Raises GpuError if too large."""
        if max(size) > self.limits.max_texture:
            raise GpuError(f"a texture of {size[0]}×{size[1]} texels: this driver's limit is {self.limits.max_texture}")
        texture = self.ctx.texture(size, components, data, dtype=dtype, alignment=1)
        texture.filter = (moderngl.NEAREST, moderngl.NEAREST)
        texture.repeat_x = texture.repeat_y = False
        return texture

    def buffer(self, size: int) -> moderngl.Buffer:
        """So many bytes, to be written by the GPU or the host."""
        return self.ctx.buffer(reserve=size)

    def depth_texture(self, size: tuple[int, int]) -> moderngl.Texture:
        """A depth map to draw into and to read as numbers (no comparison)."""
        texture = self.ctx.depth_texture(size)
        texture.compare_func = ""
        texture.filter = (moderngl.NEAREST, moderngl.NEAREST)
        return texture

    def target(self, *colour: moderngl.Texture, depth: moderngl.Texture | None = None) -> moderngl.Framebuffer:
        """To draw into. Raises GpuError where the driver has no memory for it."""
        try:
            return self.ctx.framebuffer(list(colour), depth)
        except moderngl.Error as error:
            width, height = colour[0].size if colour else (0, 0)
            raise GpuError(f"{width}×{height} pixels do not fit the memory of this driver: {error}") from None

    def release_all(self, *resources: Any) -> None:
        """Release targets, textures and buffers, targets first. moderngl goes back to the target it bound last, even one that is
        gone: bind the default one before."""
        self.ctx.detect_framebuffer(0).use()
        for resource in sorted(resources, key=lambda r: not isinstance(r, moderngl.Framebuffer)):
            resource.release()

    @contextlib.contextmanager
    def only_compiling(self) -> Iterator[None]:
        """Passes draw a pixel at most while inside: drivers compile a program when it first draws. What is drawn is wrong."""
        self.compiling = True
        try:
            yield
        finally:
            self.compiling = False

    def release(self) -> None:
        self.shaders.release()
        self.timers.release()


def headless_gpu() -> Gpu:
    """A context without any window: EGL, or the platform's own where there is no EGL. Raises GpuError."""
    reasons = []
    backends: tuple[dict[str, Any], ...] = ({"backend": "egl"}, {})
    for backend in backends:
        try:
            return Gpu(moderngl.create_context(standalone=True, require=GL_REQUIRED, **backend))
        except GpuError:
            raise
        except Exception as error:  # glcontext raises bare Exception for every failure
            reasons.append(str(error).strip() or type(error).__name__)
    raise GpuError(f"no OpenGL {GL_REQUIRED / 100:.1f} context ({'; '.join(reasons)}): {EGL_HINT}")


@contextlib.contextmanager
def gpu_context() -> Any:
    """``with gpu_context() as gpu:`` a headless context that is given back."""
    gpu = headless_gpu()
    try:
        yield gpu
    finally:
        gpu.release()
        gpu.ctx.release()
