"""moderngl, and nothing about light: context, shaders, structs, passes, timers."""

from moderngl import Buffer, Framebuffer, Texture

from app.gpu.context import Gpu, Limits, gpu_context, headless_gpu
from app.gpu.kept import keep, take_over, texture_array
from app.gpu.passes import Mesh, Pass
from app.gpu.readback import ReadBack
from app.gpu.shader import Glsl, ShaderError, ShaderLibrary, glsl_constant
from app.gpu.struct import Struct

__all__ = [
    "Buffer",
    "Framebuffer",
    "Glsl",
    "Gpu",
    "Limits",
    "Mesh",
    "Pass",
    "ReadBack",
    "ShaderError",
    "ShaderLibrary",
    "Struct",
    "Texture",
    "glsl_constant",
    "gpu_context",
    "headless_gpu",
    "keep",
    "take_over",
    "texture_array",
]
