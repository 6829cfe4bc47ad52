"""``glowtree bench rays``: how long the tree of boxes takes to build, and how many rays a second are traced in it.

Rays start at the scene's texels, evenly about their cosine. Coherent: the 8×8 texels of a square share their directions, turned
into each one's own frame; incoherent: each has its own. The median of passes over all rays; and of Embree, on one thread, where
embreex is installed.
"""

from __future__ import annotations

import argparse
import importlib.util
import statistics
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from app.atlas.options import AtlasOptions
from app.bench.speed.ray_batch import EDGE, RayBatch
from app.gpu import Gpu, gpu_context
from app.lightmap.tile_pool import TilePool
from app.scene.model import F32
from app.session.loading import load
from app.util.console import Console
from app.util.tables import Column, markdown_table
from app.visibility.bvh import build_bvh
from app.visibility.rays import RayScene, corners_of

TEXELS = 30_000  # as many places as rays start from, about
RAYS = 1 << 18
FEWEST = 3  # passes
OFF = 4e-6  # solver space: how far rays start above their own surface
FARTHEST = 4.0  # solver space: beyond the scene
SQUARE = EDGE * EDGE
KINDS = {"coherent": True, "incoherent": False}
EMBREE = "embreex"
COLUMNS = (
    Column("scene", "scene"),
    Column("triangles", "triangles", ","),
    Column("build_s", "s, build", ".2f"),
    Column("megabytes", "MB", ".1f"),
    Column("cost", "cost", ".1f"),
    Column("depth", "depth"),
    Column("closest_coherent", "closest, coherent", ".2f"),
    Column("closest_incoherent", "incoherent", ".2f"),
    Column("any_coherent", "any, coherent", ".2f"),
    Column("any_incoherent", "incoherent", ".2f"),
)
EMBREE_COLUMNS = (Column("embree_closest", "Embree, closest", ".2f"), Column("embree_any", "any", ".2f"))
NOTE = (
    "Millions of rays a second from texels, whose squares of 8×8 share their directions (coherent) or do not. Cost: boxes and "
    "triangles that a ray through the whole scene meets, as the surface area heuristic has it."
)


def bench_rays(flags: argparse.Namespace) -> int:
    """Print the table. Raises UserError (SceneError)."""
    console = Console(quiet=flags.json)
    rows = []
    with gpu_context() as gpu, console.progress("rays") as tell:
        for i, name in enumerate(flags.scenes):
            tell(str(name), i / len(flags.scenes))
            rows.append(_measure(gpu, str(name), flags.seconds))
        values = {"renderer": gpu.limits.renderer, "rays": RAYS, "scenes": rows}
    columns = COLUMNS + (EMBREE_COLUMNS if any("embree_any" in row for row in rows) else ())
    console.result(values, "\n\n".join([values["renderer"], NOTE, markdown_table(columns, rows)]))
    return 0


def _measure(gpu: Gpu, name: str, seconds: float) -> dict[str, Any]:
    """seconds: of each figure."""
    pool = load(name, AtlasOptions(texels=TEXELS)).pool
    start = time.perf_counter()
    bvh = build_bvh(corners_of(pool))
    row: dict[str, Any] = {
        "scene": Path(name).stem,
        "triangles": len(pool.scene.triangles),
        "build_s": time.perf_counter() - start,
    }
    rays = RayScene(gpu, pool)
    row |= {"megabytes": rays.memory * 1e-6, "cost": bvh.cost, "depth": bvh.depth}
    for kind, shared in KINDS.items():
        origins, directions = texel_rays(pool, RAYS, shared)
        batch = RayBatch(gpu, rays, origins, directions)
        for query, any_will_do in (("closest", False), ("any", True)):

            def run(any_will_do: bool = any_will_do, batch: RayBatch = batch) -> None:
                batch.trace(any_will_do)
                gpu.ctx.finish()

            row[f"{query}_{kind}"] = million_a_second(run, RAYS, seconds)
        batch.release()
    rays.release()
    if importlib.util.find_spec(EMBREE) is not None:
        row |= _embree(pool, origins, directions, seconds)
    return row


def million_a_second(run: Callable[[], object], rays: int, seconds: float) -> float:
    """Of the median pass."""
    run()  # compiles, and fills the caches
    times: list[float] = []
    while len(times) < FEWEST or sum(times) < seconds:
        start = time.perf_counter()
        run()
        times.append(time.perf_counter() - start)
    return rays / statistics.median(times) * 1e-6


def texel_rays(pool: TilePool, count: int, shared: bool) -> tuple[F32, F32]:
    """Origins and directions (count, 4) of RayBatch, SQUARE from the texels of a square, evenly about their cosine, the squares
    in the order of the tile pool. shared: whether these rays have one direction, each in its own texel's frame."""
    rng = np.random.default_rng(1)
    surfaces, side = pool.surfaces, pool.tile // EDGE

    def squares(tiles: Any) -> Any:
        cells = tiles.reshape(pool.tiles, side, EDGE, side, EDGE, -1).swapaxes(2, 3)
        return cells.reshape(pool.tiles * side * side, SQUARE, -1)

    covered = squares(surfaces.face)[..., 0] >= 0
    used = np.flatnonzero(covered.any(1))
    # Texels that cover nothing do what the first one that does would
    texel = np.where(covered, np.arange(SQUARE), covered.argmax(1)[:, None])
    many = -(-count // SQUARE)
    chosen = np.sort(used[np.arange(many) % len(used)]) if many > len(used) else np.sort(rng.choice(used, many, False))
    index = chosen[:, None], texel[chosen]
    normal = squares(surfaces.normal)[index].reshape(-1, 3)
    origin = squares(pool.space.local_from_world(surfaces.position))[index].reshape(-1, 3) + OFF * normal
    u = rng.random((many, 1 if shared else SQUARE, 2)).repeat(SQUARE if shared else 1, 1).reshape(-1, 2)
    radius, angle = np.sqrt(u[:, :1]), 2 * np.pi * u[:, 1:]
    x = np.cross(normal, np.eye(3)[np.abs(normal).argmin(1)])
    x /= np.linalg.norm(x, axis=1, keepdims=True)
    direction = radius * (np.cos(angle) * x + np.sin(angle) * np.cross(normal, x)) + np.sqrt(1 - u[:, :1]) * normal
    ends = np.zeros(len(origin)), np.full(len(origin), FARTHEST)
    rows = [np.column_stack(part).astype(np.float32)[:count] for part in zip((origin, direction), ends, strict=True)]
    return rows[0], rows[1]


def _embree(pool: TilePool, origins: F32, directions: F32, seconds: float) -> dict[str, float]:
    from embreex.mesh_construction import TriangleMesh
    from embreex.rtcore_scene import EmbreeScene

    scene = EmbreeScene()
    TriangleMesh(scene, corners_of(pool).astype(np.float32))
    origin, direction = np.ascontiguousarray(origins[:, :3]), np.ascontiguousarray(directions[:, :3])

    def rate(query: str) -> float:
        return million_a_second(lambda: scene.run(origin, direction, query=query), len(origin), seconds)

    return {"embree_closest": rate("INTERSECT"), "embree_any": rate("OCCLUDED")}
