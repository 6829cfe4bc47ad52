"""Unfold curved and irregular surfaces into charts: least-squares conformal maps by xatlas [Levy02], in metres.

xatlas runs in a process of its own with a time limit; its answer is cached by what went in. Where it fails, and for the
few triangles it gives up on, every flat piece becomes a chart by itself, laid down without distortion.

Surfaces of one shape are unfolded once (copies.py). What xatlas takes for a chart grows with the square of its triangles: it
looks at all of them for each that it adds. So large surfaces are laid flat where they are seen whole from one side
(large_surfaces.py); others have charts of about ``CHART`` triangles at most, and the largest are cut into pieces.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from app.atlas.copies import find_surfaces
from app.atlas.large_surfaces import large_surfaces, pieces, seen_whole
from app.atlas.sides import distinct_rows, kinds, middle, numbered, totals
from app.scene.model import F64, I32
from app.util import cache

Progress = Callable[[str, float], None]

TIME_LIMIT_S = 120.0
TIME_LIMIT_S_PER_TRIANGLE = 1e-3  # more than ten times what xatlas takes for models that it digests
EXPECTED_S = 1.0, 5e-5  # and for each triangle: what it takes, about
POLL_S = 0.05
SEEN = 0.05  # of the work, that is done when large surfaces have been looked at
CACHE_FILES = 64  # kept, newest first
FORMAT = b"glowtree unwrap 4"  # changes when the worker's options or its answer do
# Diagonal of what xatlas sees: it drops triangles smaller than 1e-7 in area, whatever the unit.
XATLAS_SIZE = 1000.0
# Triangles of a chart of a large surface, if all were of one size: of half as many, seams are seen where light is coarse.
CHART = 1024
# A triangle squeezed to less than this share of its area, or turned over, is unusable in its chart.
LEAST_SHARE = 1e-4


@dataclass(frozen=True, eq=False)
class Unfolded:
    """chart (m,) i32 numbered from 0; uv (m, 3, 2) f64 [m], to scale in area, right-handed seen from the front.

    by_xatlas: how many of the charts come from xatlas; seen_whole: how many are large surfaces as they are seen from one side.
    Both are numbered before flat pieces.
    """

    chart: I32
    uv: F64
    by_xatlas: int
    seen_whole: int
    warnings: tuple[str, ...] = ()


def unwrap(
    points: F64,
    triangles: I32,
    corners: F64,
    groups: I32,
    facet: I32,
    *,
    time_limit: float | None = None,
    progress: Progress | None = None,
) -> Unfolded:
    """Charts for triangles (m, 3) into welded points (n, 3) [m]; charts never mix groups (m,).

    corners (m, 3, 3) [m]: as the scene has them, for welding can rob a sliver of its area. facet (m,): connected flat
    pieces, the charts to fall back to. time_limit [s]; by default it grows with m.
    """
    if not len(triangles):
        return Unfolded(np.empty(0, np.int32), np.empty((0, 3, 2)), 0, 0)
    warnings: list[str] = []
    tell = progress or (lambda stage, share: None)
    surfaces = find_surfaces(points, triangles, groups)
    originals, of = kinds(surfaces.original)
    whole, uv = seen_whole(
        points,
        triangles[originals],
        surfaces.surface[originals],
        lambda share: tell("finding what is seen whole from one side", SEEN * share),
    )
    chart = np.full(len(originals), -1, np.int32)
    curved = np.flatnonzero(whole < 0)
    if len(curved):
        mine = originals[curved]
        try:
            chart[curved], uv[curved] = _xatlas(
                points,
                triangles[mine],
                groups[mine],
                surfaces.surface[mine],
                time_limit,
                lambda stage, share: tell(stage, SEEN + (1 - SEEN) * share),
            )
        except _UnwrapError as failure:
            warnings.append(f"xatlas {failure}: every flat piece is a chart of its own")
    chart = np.where(whole < 0, chart, int(chart.max()) + 1 + whole)
    if len(originals) < len(triangles):
        chart, uv = _of_copies(chart[of], surfaces.surface), uv[of]
    chart, uv = _to_scale(chart, uv, corners)
    count, laid = int(chart.max()) + 1, len(kinds(chart[(whole >= 0)[of] & (chart >= 0)])[0])
    rest = np.flatnonzero(chart < 0)
    if len(rest):
        label = np.unique(facet[rest], return_inverse=True)[1].astype(np.int32)
        chart[rest] = count + label
        uv[rest] = _laid_flat(corners[rest], label)
    return Unfolded(chart, uv, count - laid, laid, tuple(warnings))


class _UnwrapError(Exception):
    """xatlas gave no usable answer; the message completes "xatlas ..."."""


def _of_copies(chart: I32, surface: NDArray[np.int64]) -> I32:
    """The charts of originals, apart for each surface that has them."""
    inside = np.flatnonzero(chart >= 0)
    own = np.full(len(chart), -1, np.int32)
    own[inside] = distinct_rows(surface[inside], chart[inside])[1]
    return own


def _xatlas(
    points: F64,
    triangles: I32,
    groups: I32,
    surface: NDArray[np.int64],
    time_limit: float | None,
    progress: Progress,
) -> tuple[I32, F64]:
    """xatlas's own charts, from the cache or from a worker."""
    used, local = kinds(triangles)
    centred = points[used] - (points[used].min(axis=0) + points[used].max(axis=0)) / 2
    centred *= XATLAS_SIZE / np.linalg.norm(np.ptp(centred, axis=0))
    meshes, scale, most_area = _meshes(centred[local], groups, surface)
    given = {
        "positions": centred.astype(np.float32),
        "triangles": local.astype(np.uint32),
        "groups": meshes,
        "scale": scale,
        "most_area": np.float32(most_area),
    }
    cached = cache.entry("unwrap", cache.digest(FORMAT + version("xatlas").encode(), given))
    answer = _read(cached, len(triangles))
    if answer is None:
        if time_limit is None:
            time_limit = TIME_LIMIT_S + TIME_LIMIT_S_PER_TRIANGLE * len(triangles)
        with tempfile.TemporaryDirectory(prefix="glowtree-") as folder:
            source, target = Path(folder) / "in.npz", Path(folder) / "out.npz"
            np.savez(source, **given)
            _run_worker(source, target, time_limit, len(triangles), progress)
            answer = _read(target, len(triangles))
            if answer is None:
                raise _UnwrapError("wrote no charts")
            cache.store(target.read_bytes(), cached, CACHE_FILES)
    return answer


def _meshes(corners: F64, groups: I32, surface: NDArray[np.int64]) -> tuple[I32, NDArray[np.float32], float]:
    """What xatlas is given as one mesh: its number for each triangle (m,), a scale for each mesh, and the area of a chart at most
    in these scales; 0 where no surface is large.

    Small surfaces of a group are a mesh together, to no other scale, and their charts as large as xatlas likes.
    """
    large = large_surfaces(surface)
    mesh = numbered(groups).astype(np.int32)
    if not large:
        return mesh, np.ones(int(mesh.max()) + 1, np.float32), 0.0
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1) / 2
    most_area = max(float(area.sum() - sum(area[rows].sum() for rows in large)), 1.0)
    centre = middle(corners)
    parts = [part for rows in large for part in pieces(centre, rows)]
    number = int(mesh.max()) + 1
    for k, rows in enumerate(parts):
        mesh[rows] = number + k
    mesh = numbered(mesh).astype(np.int32)
    scale = np.ones(int(mesh.max()) + 1)
    for rows in parts:
        scale[mesh[rows[0]]] = np.sqrt(
            most_area / CHART * len(rows) / max(float(area[rows].sum()), np.finfo(float).tiny)
        )
    return mesh, scale.astype(np.float32), most_area


def _run_worker(source: Path, target: Path, time_limit: float, triangles: int, progress: Progress) -> None:
    """Run xatlas on source; whatever ends the wait (the limit, Ctrl-C, a cancelling callback) ends the worker."""
    root = str(Path(__file__).resolve().parents[2])
    path = os.pathsep.join(p for p in (root, os.environ.get("PYTHONPATH")) if p)
    command = [sys.executable, "-m", "app.atlas.unwrap_worker", str(source), str(target)]
    with (source.with_name("log")).open("w+b") as log:
        start = time.monotonic()
        worker = subprocess.Popen(command, env={**os.environ, "PYTHONPATH": path}, stdout=log, stderr=log)
        try:
            while worker.poll() is None:
                elapsed = time.monotonic() - start
                if elapsed > time_limit:
                    raise _UnwrapError(f"took longer than {time_limit:g} s")
                progress("unfolding curved pieces", elapsed / (elapsed + EXPECTED_S[0] + EXPECTED_S[1] * triangles))
                time.sleep(POLL_S)
        finally:
            worker.kill()
            worker.wait()
        if worker.returncode:
            log.seek(0)
            last = log.read().decode(errors="replace").strip().splitlines()
            raise _UnwrapError(f"failed ({last[-1] if last else f'exit code {worker.returncode}'})")


def _read(path: Path, count: int) -> tuple[I32, F64] | None:
    """Charts from a file, or None where there is no such file or it is not whole."""
    data = cache.read(path)
    if data is None or not {"chart", "uv"} <= data.keys():
        return None
    chart, uv = data["chart"].astype(np.int32), data["uv"].astype(np.float64)
    return (chart, uv) if chart.shape == (count,) and uv.shape == (count, 3, 2) and np.isfinite(uv).all() else None


def _to_scale(chart: I32, uv: F64, corners: F64) -> tuple[I32, F64]:
    """Undo xatlas's scaling: right-handed charts in metres, each with the area of its surface.

    Triangles that have no area in their chart, or lie in it upside down, lose their chart (-1); the rest is renumbered.
    """
    chart, uv = chart.copy(), uv - uv.mean(axis=(0, 1))
    inside = chart >= 0
    if not inside.any():
        return chart, uv
    label = np.where(inside, chart, 0)
    count = int(label.max()) + 1
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1) / 2
    area = np.where(inside, area, 0.0)
    flat = np.where(inside, _signed_area(uv), 0.0)
    uv[totals(label, flat, count)[label] < 0, :, 0] *= -1
    # xatlas stretches each chart to whole texels of its page, along u and v apart: even out the mean stretch
    stretch = _squared_stretch(uv, corners)
    weight = np.maximum(totals(label, area, count), np.finfo(float).tiny)
    mean = totals(label, area[:, None] * stretch, count) / weight[:, None]
    uv /= np.sqrt(np.where(mean > 0, mean, 1.0))[label][:, None]
    flat = np.where(inside, _signed_area(uv), 0.0)
    total = totals(label, np.maximum(flat, 0.0), count)
    scale = np.sqrt(weight / np.where(total > 0, total, np.inf))
    uv *= scale[label][:, None, None]
    chart[inside & ~(flat * scale[label] ** 2 > LEAST_SHARE * area)] = -1
    inside = chart >= 0
    chart[inside] = numbered(chart[inside])
    return chart, uv


def _signed_area(uv: F64) -> F64:
    a, b = uv[:, 1] - uv[:, 0], uv[:, 2] - uv[:, 0]
    return (a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]) / 2


def _squared_stretch(uv: F64, corners: F64) -> NDArray[np.float64]:
    """(m, 2): squared length of the surface gradient of u and of v in each triangle."""
    a, b = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    da, db = uv[:, 1] - uv[:, 0], uv[:, 2] - uv[:, 0]
    turned = a[:, :, None] * db[:, None] - b[:, :, None] * da[:, None]
    doubled_area = np.linalg.norm(np.cross(a, b), axis=1)[:, None]
    return np.asarray((np.linalg.norm(turned, axis=1) / doubled_area) ** 2)


def _laid_flat(corners: F64, label: I32) -> F64:
    """Each flat piece in its own plane [m], its longest edge along u, without distortion."""
    count = int(label.max()) + 1
    edges = np.roll(corners, -1, axis=1) - corners
    lengths = np.linalg.norm(edges, axis=2)
    order = np.lexsort((lengths.max(axis=1), label))
    best = np.empty(count, np.int64)
    best[label[order]] = order  # the last of each label wins: the longest
    u = edges[best, lengths[best].argmax(axis=1)]
    u /= np.linalg.norm(u, axis=1, keepdims=True)
    cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    n = totals(label, cross, count)
    n -= np.einsum("ck,ck->c", n, u)[:, None] * u
    n /= np.linalg.norm(n, axis=1, keepdims=True)
    origin = np.zeros((count, 3))
    origin[label] = corners[:, 0]
    local = corners - origin[label][:, None]
    return np.stack(
        [np.einsum("mck,mk->mc", local, axis[label]) for axis in (u, np.cross(n, u))],
        axis=2,
    )
