"""What a table of the papers is: its columns, the jobs that measure its rows, and perhaps a plot of them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from app.gpu import Gpu
from app.util.tables import Column, Row

SOLVE = 10  # times as long as another measurement a solve may take
Measure = Callable[[Gpu, float], Row]


@dataclass(frozen=True)
class Plot:
    """A line for each y key over the x key, for each value of ``by``; or, of a ``curve``, one for each row."""

    x: str
    ys: tuple[str, ...]
    by: str
    labels: tuple[str, str]
    logarithmic: bool = True


@dataclass(frozen=True)
class Table:
    """jobs: (label, what measures one row within about so many seconds). finish: adds what follows from all rows.
    verdicts: what the rows say of the paper's conclusions, a line each."""

    name: str
    title: str
    theirs: str
    notes: tuple[str, ...]
    columns: tuple[Column, ...]
    jobs: tuple[tuple[str, Measure], ...]
    plot: Plot | None = None
    finish: Callable[[list[Row]], None] = lambda rows: None
    verdicts: Callable[[list[Row]], list[str]] = lambda rows: []
