"""From a node set to a lightmap and its solver on the GPU, in parts that a window makes one per frame."""

from __future__ import annotations

import contextlib
from collections.abc import Generator, Mapping

from app.atlas.lightmap import Lightmap, upload
from app.atlas.node_set import Array, NodeSet
from app.gpu import Gpu, Texture
from app.render.frame import FrameRenderer
from app.solvers import DEFAULT_SOLVER, SOLVERS, ShootingOptions, Solver


def prepare(
    gpu: Gpu,
    nodes: NodeSet,
    arrays: Mapping[str, Array],
    options: ShootingOptions,
    renderer: FrameRenderer,
    interpolation: str,
    *,
    solver_name: str = DEFAULT_SOLVER,
) -> Generator[None, None, tuple[Lightmap, Solver[ShootingOptions]]]:
    """Upload a node set's ``arrays``, and draw once with each program, since drivers compile it then; yields after each part. The
    light is as before the first shot. interpolation: that pictures will be drawn with. Raises UserError; then, and when given
    up between two parts, nothing stays on the GPU."""
    with contextlib.ExitStack() as undo:
        textures: dict[str, Texture] = {}
        uploads = undo.enter_context(contextlib.ExitStack())
        for name, array in arrays.items():
            textures[name] = upload(gpu, array)
            uploads.callback(gpu.release_all, textures[name])
            yield
        lightmap = Lightmap(gpu, nodes, storage=options.storage, textures=textures)
        uploads.pop_all()
        undo.callback(lightmap.release)
        gpu.ctx.finish()
        yield
        solver = SOLVERS[solver_name](gpu, lightmap, options)
        undo.callback(solver.release)
        yield
        for run in solver.passes(1).values():
            run()
            gpu.ctx.finish()
            yield
        solver.reset()
        yield
        renderer.prepare(lightmap, interpolation)
        undo.callback(renderer.give_up)
        gpu.ctx.finish()
        yield
        undo.pop_all()
    return lightmap, solver
