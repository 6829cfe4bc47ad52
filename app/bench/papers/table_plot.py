"""A table of the papers as a plot; needs matplotlib, which only the extra ``bench`` installs."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from app.bench.figures import new_figure, save
from app.bench.papers.table import Plot
from app.util.tables import Row

SIZE = (10.0, 5.0)  # inches
LEGEND = 18  # lines that fit beside the plot in letters of 10 points
STYLES = ("-", "--", ":", "-.")


def draw(path: Path, title: str, plot: Plot, rows: list[Row], renderer: str) -> None:
    """Write one PNG. Raises UserError if it cannot be written."""
    figure = new_figure(*SIZE)
    axes = figure.subplots()
    for label, colour, style, points in lines(plot, rows):
        marker = "" if plot.ys == ("curve",) else "o"
        axes.plot(*zip(*points, strict=True), f"C{colour}", linestyle=STYLES[style], marker=marker, label=label)
    if plot.logarithmic:
        axes.set_yscale("log")
        if plot.ys != ("curve",):
            axes.set_xscale("log")
    axes.set(title=f"{title}\n{renderer}", xlabel=plot.labels[0], ylabel=plot.labels[1])
    axes.grid(alpha=0.3)
    count = len(axes.get_legend_handles_labels()[1])
    figure.legend(loc="outside right upper", fontsize=10 * min(1.0, LEGEND / max(count, 1)))
    save(figure, path)


def lines(plot: Plot, rows: list[Row]) -> Iterator[tuple[str, int, int, list[tuple[float, float]]]]:
    """Label, number of its group and of its y key, and (x, y) points of each line, in the order of the rows."""
    for colour, value in enumerate(dict.fromkeys(row.get(plot.by) for row in rows)):
        group = [row for row in rows if row.get(plot.by) == value]
        name = "" if value is None else f"{value:,} {plot.by}" if isinstance(value, int) else str(value)
        for style, y in enumerate(plot.ys):
            if y == "curve":
                yield name, colour, style, group[0]["curve"]
            else:
                label = y.replace("_", " ")
                points = [(row[plot.x], row[y]) for row in group if None not in (row.get(plot.x), row.get(y))]
                if points:
                    yield (f"{name}: {label}" if name else label), colour, style, points
