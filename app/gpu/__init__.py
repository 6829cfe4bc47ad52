"""moderngl, and nothing about light: context, shaders, passes, timers."""

from moderngl import Buffer, Framebuffer, Texture

from app.gpu.context import Gpu, Limits, gpu_context, headless_gpu
from app.gpu.passes import Mesh, Pass
from app.gpu.readback import ReadBack
from app.gpu.shader import ShaderError, ShaderLibrary

__all__ = [
    "Buffer",
    "Framebuffer",
    "Gpu",
    "Limits",
    "Mesh",
    "Pass",
    "ReadBack",
    "ShaderError",
    "ShaderLibrary",
    "Texture",
    "gpu_context",
    "headless_gpu",
]
