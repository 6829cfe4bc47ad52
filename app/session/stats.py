"""Where a solution stands, in numbers that panels and reports show."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from app.lightmap.lightmap import Lightmap
from app.session.run import Run


@dataclass(frozen=True)
class Stats:
    """done: work in the solver's ``unit``, of which ``remains`` says what is left. remaining: see Progress. Energies are summed
    over RGB [W]. per_second: work of late, and of the whole solve once it has converged. resolved: what options that were left
    unset have come to. figures, counts: see Inspection."""

    unit: str
    remains: str
    done: int
    seconds: float
    remaining: float
    progress: float  # 0 to 1, see Run.furthest
    emitted: float
    absorbed: float
    escaped: float
    unshot: float
    imbalance: float
    per_second: float
    converged: bool
    refining: bool  # whether leaves come and go
    leaves: str  # what is being done for them
    note: str | None
    doing: str  # see Progress
    edit_work: int | None  # since the materials were last edited
    fresh_work: int | None  # that it took from nothing until converged
    texels: int
    tiles: int
    uniform_texels: int  # if all leaves of a quadtree were of its finest level
    triangles: int
    charts: int
    figures: Mapping[str, str]
    counts: Mapping[str, int]
    counts_in_edit: Mapping[str, int]  # since the materials were last edited
    memory_mib: float
    resolved: Mapping[str, Any]


def stats_of(run: Run, lightmap: Lightmap) -> Stats:
    """Where the solution of an open scene stands."""
    balance, progress, done, inspection = run.energy, run.progress, run.converged, run.solver.inspect()
    return Stats(
        unit=run.family.unit,
        remains=run.family.remains,
        done=progress.done,
        seconds=run.seconds,
        remaining=progress.remaining,
        progress=run.furthest,
        emitted=float(balance.emitted.sum()),
        absorbed=float(balance.absorbed.sum()),
        escaped=float(balance.escaped.sum()),
        unshot=float(balance.unshot.sum()),
        imbalance=balance.imbalance_share,
        per_second=progress.done / run.seconds
        if done and run.seconds > 0
        else run.history.work_per_second(run.seconds),
        converged=done,
        refining=progress.refining,
        leaves=progress.leaves,
        note=progress.note,
        doing=progress.doing,
        edit_work=run.effort.edit_work(progress.done),
        fresh_work=run.effort.fresh_work,
        texels=lightmap.texel_count,
        tiles=lightmap.tiles,
        uniform_texels=lightmap.pool.uniform_texels(lightmap.options.depth),
        triangles=len(lightmap.scene.triangles),
        charts=lightmap.charts.chart_count,
        figures=inspection.figures,
        counts=inspection.counts,
        counts_in_edit=run.effort.edit_counts(inspection.counts),
        memory_mib=sum(lightmap.memory.values()) / 2**20,
        resolved=run.solver.resolved,
    )
