"""The memory bandwidth of this machine's GPU (or of the CPU that plays one): a copy, which no pass can beat."""

from __future__ import annotations

import statistics
import time

from app.gpu import Gpu


def copy_bandwidth(gpu: Gpu, size: tuple[int, int], repeats: int = 15) -> float:
    """Bytes per second, read and written, of copying an RGBA32F texture of ``size`` to another."""
    source, sink = gpu.texture(size, 4, "f4"), gpu.texture(size, 4, "f4")
    targets = gpu.target(source), gpu.target(sink)
    targets[0].clear()
    times = []
    for _ in range(repeats):
        start = time.perf_counter()
        gpu.ctx.copy_framebuffer(targets[1], targets[0])
        gpu.ctx.finish()
        times.append(time.perf_counter() - start)
    gpu.release_all(*targets, source, sink)
    return 2 * 16 * size[0] * size[1] / statistics.median(times)
