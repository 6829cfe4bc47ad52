"""Estimate a solution's own error, without any reference: from what it lacks at random points, and what comes back of that.

    δ = H'(x) - H(x)                 H' gathered along rays, see ray_gather.py; H read from the lightmap
    e = δ + K ρ e = Σ (K ρ)^k δ      what the solution lacks: light that is missing is not reflected either, see network.py
    relative RMS = √(mean e₁e₂) / mean (H + e)

over points that are lit: by light from lamps that goes from node to node as e does, and not by H + e, which is what noise leaves
where both cancel. e₁ and e₂ are of two independent sets of rays: what they get wrong cancels in the mean, and is taken from the
median, as their difference tells it. One point in a hundred, at a shadow's edge or near a lamp, may hold most of the error. So
many candidates are looked from along a few rays first, and points are chosen where light is and where it lacks; means are
weighted with 1 / p, p ∝ 1 + H / H̄ + |δ| / |δ|‾. What comes back is told by as many helpers, which lie where rays from these end,
by what is reflected there: points chosen for what lacks there would stand for others where less does.
"""

from __future__ import annotations

import time
from collections.abc import Generator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from app.atlas.points import Points, random_points
from app.estimate.network import Neighbours, Network
from app.estimate.ray_gather import CANDIDATES, LINKS, SHIFTS, Ends, RayGather
from app.gpu import Gpu, ReadBack
from app.lightmap.lightmap import Lightmap
from app.lightmap.probe import Probe
from app.reference.metrics import DARK
from app.scene.model import F64

SURVEYED, POINTS, SEED = 8192, 768, 7  # points that are even in area, and those of them that are looked from in earnest
FEW_RAYS = 64  # from each that is surveyed
HELPERS = 1024  # nodes where rays from points end
FEWEST = 64  # of each that are enough where they take long
TURNS = 2  # independent sets of rays from each


class ErrorEstimate(NamedTuple):
    """Estimated error of the irradiance, over so many lit points: relative RMS, bias of the mean, median of local errors [-]."""

    rms: float
    bias: float
    median: float
    points: int

    def within(self, *, median: float | None = None, rms: float | None = None) -> bool:
        """Whether it is as little as asked for, where it is."""
        return (median is None or self.median <= median) and (rms is None or self.rms <= rms)


class _Nodes(NamedTuple):
    """Points, the irradiance H (n, 3) that the solution has there, what was gathered there (n, TURNS, 4), and their links."""

    points: Points
    solution: F64
    gathered: F64
    ends: Ends


class ErrorEstimator:
    """Estimates the error of one lightmap, from so many nodes (``nodes``) at a time. Whoever makes it releases
    it."""

    def __init__(self, gpu: Gpu, lightmap: Lightmap, nodes: int) -> None:
        self._gpu, self._lightmap, self._at_once = gpu, lightmap, nodes
        self._candidates = random_points(lightmap.scene, SURVEYED, SEED)
        self._probe, self._gather = Probe(gpu, lightmap, self._candidates), RayGather(gpu, lightmap, TURNS * nodes)

    def parts(self, seconds: float) -> Generator[float, None, ErrorEstimate | None]:
        """Look, some nodes in each part; yields the share done. After so many seconds FEWEST are enough. None where no point is
        lit, or the light is not finite."""
        random, start = np.random.default_rng(SEED), time.perf_counter()
        solution = self._probe.irradiance(self._probe.look())
        if not np.isfinite(solution).all() or not self._gather.find_lamps():
            return None
        lacking = (yield from self._survey(random)) - solution
        chosen, weights = choose_points(solution, lacking, random)
        points = yield from self._looked(self._candidates.only(chosen), random, start + seconds / 2, 0.1)
        weights = weights[: len(points.points)]
        nodes, network = points, None
        reflecting = choose_helpers(points.ends, weights, random)
        if len(reflecting):
            helpers = yield from self._looked(reflecting, random, start + seconds, 0.5)
            nodes = _both(points, helpers)
            network = yield from self._network(nodes, len(helpers.points))
        if not np.isfinite(nodes.gathered).all() or not np.isfinite(nodes.solution).all():
            return None
        lacking = nodes.gathered[..., :3] - nodes.solution[:, None]
        light = np.repeat(nodes.gathered[..., 3].mean(1)[:, None, None], 3, axis=2)
        if network is not None:
            lacking, light = network.with_bounces(lacking), network.with_bounces(light)
        judged = slice(0, len(weights))
        return estimate_error(nodes.solution[judged], lacking[judged], light[judged, 0].mean(1), weights)

    def release(self) -> None:
        self._probe.release()
        self._gather.release()

    def _survey(self, random: np.random.Generator) -> Generator[float, None, F64]:
        """(n, 3) irradiance at all candidates, along FEW_RAYS."""
        gather, found = self._gather, []
        position, normal = self._candidates.positions_normals(self._lightmap.scene)
        shifts = random.random((len(position), SHIFTS))
        pending: tuple[int, ReadBack] | None = None
        try:
            for first in range(0, len(position), gather.rows):
                now = slice(first, min(first + gather.rows, len(position)))
                looked = gather.look(position[now], normal[now], shifts[now], FEW_RAYS)
                if pending is not None:  # one part late: nothing waits
                    found.append(gather.irradiance(pending[1], pending[0], FEW_RAYS))
                pending = now.stop - first, looked
                yield 0.1 * now.stop / len(position)
            assert pending is not None
            found.append(gather.irradiance(pending[1], pending[0], FEW_RAYS))
            pending = None
        finally:
            if pending is not None:
                pending[1].take()
        return np.concatenate(found)[:, :3]

    def _looked(
        self, points: Points, random: np.random.Generator, end: float, share: float
    ) -> Generator[float, None, _Nodes]:
        """From points, or FEWEST of them where it takes until ``end``. share: done before."""
        gather, step = self._gather, self._at_once
        position, normal = points.positions_normals(self._lightmap.scene)
        shifts = random.random((len(points), TURNS + 1, SHIFTS))
        light: list[F64] = []
        ends: list[Ends] = []
        pending: tuple[int, ReadBack, tuple[ReadBack, ReadBack]] | None = None

        def read() -> None:
            nonlocal pending
            assert pending is not None
            (count, looked, links), pending = pending, None
            light.append(gather.irradiance(looked, TURNS * count).reshape(count, TURNS, 4))
            ends.append(gather.ends(links, count))

        try:
            for first in range(0, len(points), step):
                if first >= FEWEST and time.perf_counter() > end:
                    break
                now = slice(first, min(first + step, len(points)))
                x, n = (np.repeat(of[now], TURNS, axis=0) for of in (position, normal))
                looked = gather.look(x, n, shifts[now, :TURNS].reshape(-1, SHIFTS))
                links = gather.look_for_ends(position[now], normal[now], shifts[now, TURNS])
                if pending is not None:  # one part late: nothing waits
                    read()
                pending = now.stop - first, looked, links
                yield share + 0.4 * now.stop / len(points)
            read()
        finally:
            for left in () if pending is None else (pending[1], *pending[2]):
                left.take()
        gathered = np.concatenate(light)
        used = points.only(np.arange(len(gathered)))
        return _Nodes(used, self._solution_at(used), gathered, _joined(ends))

    def _solution_at(self, points: Points) -> F64:
        probe = Probe(self._gpu, self._lightmap, points)
        solution = probe.irradiance(probe.look())
        probe.release()
        return solution

    def _network(self, nodes: _Nodes, helpers: int) -> Generator[float, None, Network]:
        """Which of the last nodes stand for the ends of the links of all."""
        gather, space, scene = self._gather, self._lightmap.space, self._lightmap.scene
        position, normal = nodes.points.positions_normals(scene)
        gather.set_nodes(position, normal)
        count, step = len(position), self._gather.rows
        light = nodes.solution.mean(1)
        helping = slice(count - helpers, count)
        neighbours = Neighbours(space.local_from_world(position[helping]), normal[helping], light[helping])
        found = []
        for first in range(0, count, step):
            rows = slice(first, min(first + step, count))
            mine = nodes.ends.points.only(np.arange(rows.start * LINKS, rows.stop * LINKS))
            at, facing = mine.positions_normals(scene)
            candidates = neighbours.of(space.local_from_world(at), facing, nodes.ends.irradiance[rows].ravel())
            candidates[~nodes.ends.hit[rows].ravel()] = -1
            looked = gather.look_at_helpers(first, candidates.reshape(-1, LINKS, CANDIDATES), count - helpers)
            found.append(gather.seen(looked, rows.stop - first))
            yield 0.9 + 0.1 * rows.stop / count
        return Network(np.concatenate(found), nodes.ends.albedo, helpers)


def choose_points(solution: F64, lacking: F64, random: np.random.Generator) -> tuple[NDArray[np.int64], F64]:
    """POINTS of the candidates by their irradiance (n, 3) and what lacks of it (n, 3), and the weight of each (POINTS,)."""
    wanted = np.ones(len(solution))
    for reason in (np.maximum(solution.mean(1), 0.0), np.linalg.norm(lacking, axis=1)):
        wanted += reason / max(float(reason.mean()), 1e-300)
    chosen = random.choice(len(solution), POINTS, p=wanted / wanted.sum())
    return chosen, np.asarray(1.0 / wanted[chosen])


def choose_helpers(ends: Ends, weights: F64, random: np.random.Generator) -> Points:
    """HELPERS of the ends of links from points with weights (n,): half of them by what they reflect, half by how much they do.
    None where nothing reflects, or all links end in the sky."""
    shares = np.zeros(ends.hit.size)
    albedo = ends.albedo.mean(2)
    for reflects in (albedo * np.maximum(ends.irradiance, 0.0), albedo):
        share = (weights[:, None] * reflects).ravel()
        shares += share / max(float(share.sum()), 1e-300)
    if not shares.sum() > 0:
        return ends.points.only(np.zeros(0, np.int64))
    return ends.points.only(random.choice(len(shares), HELPERS, p=shares / shares.sum()))


def estimate_error(solution: F64, lacking: F64, light: F64, weights: F64) -> ErrorEstimate | None:
    """Of irradiance (n, 3) that lacks (n, 2, 3), by two independent estimates, where so much light (n,) is, about; with weights
    (n,). None where no point is lit."""
    share = weights / weights.sum()
    lit = light > DARK * (share @ light)
    if not lit.any():
        return None
    share, lacking, right = share[lit] / share[lit].sum(), lacking[lit], (solution + lacking.mean(1))[lit]
    mean = float(share @ right.mean(1))
    if not mean > 0:
        return None
    first, second = lacking.transpose(1, 0, 2)
    square = float(share @ (first * second).mean(1))
    length = np.maximum(np.linalg.norm(right, axis=1), 1e-300)
    local, noise = (
        _median(np.linalg.norm(of, axis=1) / length, share) for of in ((first + second) / 2, (first - second) / 2)
    )
    return ErrorEstimate(
        rms=float(np.sqrt(max(square, 0.0))) / mean,
        bias=-float(share @ (first + second).mean(1)) / 2 / mean,
        median=float(np.sqrt(max(local**2 - noise**2, 0.0))),
        points=int(lit.sum()),
    )


def _both(a: _Nodes, b: _Nodes) -> _Nodes:
    return _Nodes(
        _joined_points([a.points, b.points]),
        np.concatenate([a.solution, b.solution]),
        np.concatenate([a.gathered, b.gathered]),
        _joined([a.ends, b.ends]),
    )


def _joined(parts: list[Ends]) -> Ends:
    hit, points, albedo, irradiance = zip(*parts, strict=True)
    return Ends(np.concatenate(hit), _joined_points(list(points)), np.concatenate(albedo), np.concatenate(irradiance))


def _joined_points(parts: list[Points]) -> Points:
    return Points(*(np.concatenate([getattr(p, name) for p in parts]) for name in ("triangle", "back", "weights")))


def _median(values: F64, share: F64) -> float:
    order = np.argsort(values)
    return float(values[order][np.searchsorted(np.cumsum(share[order]), 0.5)])
