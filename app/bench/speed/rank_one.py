"""An update of rank one of the local matrix is bound by memory, of which a copy shows the bandwidth, or by its fragments.

The time of fragments is that of a constant colour, and what each vector more adds, which is nothing where memory is waited for.
"""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from app.bench.speed.memory_copy import MemoryCopy
from app.bench.timing import FEWEST
from app.gpu import Gpu, Pass
from app.solvers.local.matrix import PENDING, LocalMatrix

PAIR = 2  # vectors that wait, of a node that leaves and of one that enters


@dataclass(frozen=True)
class RankOneTimes:
    """Times are medians in milliseconds. update: to add what waits of one pair of nodes; copy: of a texture of the matrix's
    format and half its area, as many bytes; constant: of a constant colour blended over the same triangle; vector: what each
    vector more adds."""

    update: float
    copy: float
    constant: float
    vector: float


def rank_one_times(gpu: Gpu, most: int, seconds: float) -> RankOneTimes:
    """The times of an update are measured on a matrix of its own of so many slots, RGBA16F, within about so many seconds."""
    matrix, copy = LocalMatrix(gpu, most, "inverse", 16), MemoryCopy(gpu, (most, most // 2), "f2")
    texture = gpu.texture((most, most), 4, "f2")
    target, constant = gpu.target(texture), Pass(gpu, "bench/constant", vertex="solvers/local/flush")
    target.clear()

    def updated(vectors: int) -> float:
        def wait() -> None:
            for slot in range(vectors):
                matrix.leave(slot, np.zeros(3))

        return median_ms(gpu, matrix.flush, seconds / 4, before=wait)

    def blend() -> None:
        constant.draw(target, uniforms={"u_texel": 1 / most}, blend="add")

    try:
        pair, all_ = updated(PAIR), updated(PENDING)
        copied, blended = median_ms(gpu, copy.run, seconds / 4), median_ms(gpu, blend, seconds / 4)
        return RankOneTimes(pair, copied, blended, (all_ - pair) / (PENDING - PAIR))
    finally:
        matrix.release()
        copy.release()
        gpu.release_all(target, texture)


def median_ms(gpu: Gpu, run: Callable[[], object], seconds: float, before: Callable[[], object] | None = None) -> float:
    """Median milliseconds of a run, each to the end of its GPU work; the first is not counted. before: done untimed before
    each."""
    times, end = list[float](), time.perf_counter() + seconds
    while len(times) <= FEWEST or time.perf_counter() < end:
        if before is not None:
            before()
        gpu.ctx.finish()
        start = time.perf_counter()
        run()
        gpu.ctx.finish()
        times.append((time.perf_counter() - start) * 1e3)
    return statistics.median(times[1:])
