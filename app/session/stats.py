"""When a solve ends, and where it stands."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from app.session.session import Session


@dataclass(frozen=True)
class Stop:
    """When a solve ends, besides when it has converged; whichever comes first."""

    shots: int | None = None
    seconds: float | None = None


@dataclass(frozen=True)
class Stats:
    """Where the solution stands. residual: unshot share of the emitted power [-]; energies summed over RGB [W];
    shots_per_second: of late, and of the whole solve once it has converged."""

    shots: int
    seconds: float
    residual: float
    emitted: float
    absorbed: float
    escaped: float
    unshot: float
    imbalance: float
    shots_per_second: float
    converged: bool
    edit_shots: int | None  # since the materials were last edited
    fresh_shots: int | None  # that it took from nothing until converged
    texels: int
    tiles: int
    uniform_texels: int  # if all leaves of a quadtree were of its finest level
    triangles: int
    charts: int
    memory_mib: float
    level: int  # of the patches that shoot in the end
    resolution: int  # of a full face of the visibility map [px]


def stats_of(session: Session) -> Stats:
    """Where the solution of an open session stands."""
    book, lightmap = session.books, session.lightmap
    shots, seconds, done = session.solver.report.shots, session.seconds, session.converged
    return Stats(
        shots=shots,
        seconds=seconds,
        residual=session.solver.report.residual,
        emitted=float(book.emitted.sum()),
        absorbed=float(book.absorbed.sum()),
        escaped=float(book.escaped.sum()),
        unshot=float(book.unshot.sum()),
        imbalance=book.imbalance_share,
        shots_per_second=shots / seconds if done and seconds > 0 else session.history.shots_per_second,
        converged=done,
        edit_shots=session.effort.edit_shots(shots),
        fresh_shots=session.effort.fresh_shots,
        texels=lightmap.texel_count,
        tiles=lightmap.tiles,
        uniform_texels=lightmap.pool.uniform_texels(session.shooting.depth),
        triangles=len(session.scene.triangles),
        charts=session.charts.chart_count,
        memory_mib=sum(lightmap.memory.values()) / 2**20,
        level=session.solver.level,
        resolution=session.solver.resolution,
    )
