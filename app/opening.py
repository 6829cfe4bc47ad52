"""From a node set to a lightmap and its solver on the GPU, in parts that a window makes one per frame."""

from __future__ import annotations

import contextlib
from collections.abc import Generator

from app.atlas.lightmap import Lightmap
from app.atlas.node_set import NodeSet
from app.gpu import Gpu
from app.solvers import SOLVERS, ShootingOptions, UniformShooting


def prepare(
    gpu: Gpu, nodes: NodeSet, shooting: ShootingOptions
) -> Generator[None, None, tuple[Lightmap, UniformShooting]]:
    """Upload, and draw once with each program, since drivers compile it then; yields after each part. The light is as before
    the first shot. Raises UserError; then, and when given up between two parts, nothing stays on the GPU."""
    with contextlib.ExitStack() as undo:
        lightmap = Lightmap(gpu, nodes, storage=shooting.storage)
        undo.callback(lightmap.release)
        gpu.ctx.finish()
        yield
        solver = SOLVERS["shooting"](gpu, lightmap, shooting)
        undo.callback(solver.release)
        yield
        for run in solver.passes().values():
            run()
            gpu.ctx.finish()
            yield
        solver.reset()
        yield
        undo.pop_all()
    return lightmap, solver
