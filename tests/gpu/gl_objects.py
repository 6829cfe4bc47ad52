"""GL objects that are there, and those that were let go without being released."""

from __future__ import annotations

import gc
from collections.abc import Callable, Iterator

import moderngl
import pytest

from app.gpu import Gpu

RESOURCES = (moderngl.Texture, moderngl.Buffer, moderngl.Framebuffer, moderngl.VertexArray, moderngl.Program)


def held(gpu: Gpu) -> int:
    """GL objects that are there: those that Python still knows and has not released. Those that it forgot without releasing
    are counted by ``forgotten``; both together are all."""
    gc.collect()
    invalid = moderngl.InvalidObject
    objects = (o for o in gc.get_objects() if isinstance(o, RESOURCES))
    return sum(1 for o in objects if o.ctx is gpu.ctx and not isinstance(o.mglo, invalid))


@pytest.fixture
def forgotten(gpu: Gpu) -> Iterator[Callable[[], list[object]]]:
    """Says which GL objects Python has let go without releasing them, since the test began."""
    gc.collect()
    mode, gpu.ctx.gc_mode = gpu.ctx.gc_mode, "context_gc"
    gpu.ctx.objects.clear()

    def let_go() -> list[object]:
        gc.collect()
        return [o for o in gpu.ctx.objects if not isinstance(o, moderngl.InvalidObject)]

    yield let_go
    gpu.ctx.gc_mode = mode
    gpu.ctx.objects.clear()
