"""The tables and curves as pictures; the one module that needs matplotlib, which only the extra ``bench`` installs."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from pathlib import Path

from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

from app.bench.papers.table import Plot
from app.errors import UserError
from app.util.tables import Row

SIZE, CURVES_SIZE = (10.0, 5.0), (12.0, 5.0)  # inches
PEER = "0.25"  # grey
MARKERS = "osD^vP<>Xph"
STYLES = ("-", "--", ":", "-.")
DPI = 150


def draw(path: Path, title: str, plot: Plot, rows: list[Row], renderer: str) -> None:
    """Write one PNG. Raises UserError if it cannot be written."""
    figure = Figure(SIZE, dpi=DPI, layout="constrained")
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
    figure.legend(loc="outside right upper")
    _save(figure, path)


def draw_curves(
    path: Path, title: str, curves: Mapping[str, list[Row]], peers: Collection[str], noise: float | None
) -> None:
    """Write one PNG: relative RMS over seconds and over shots, one line for each curve by its label, dashed for those of peers;
    noise: of what is compared with, drawn as a floor. Raises UserError if it cannot be written."""
    figure = Figure(CURVES_SIZE, dpi=DPI, layout="constrained")
    by_time, by_shots = figure.subplots(1, 2, sharey=True)
    for k, (name, rows) in enumerate(curves.items()):
        peer = name in peers
        look = {
            "color": PEER if peer else f"C{k}",
            "linestyle": "--" if peer else "-",
            "marker": MARKERS[k % len(MARKERS)],
        }
        for axes, key, label in ((by_time, "seconds", name), (by_shots, "shots", None)):
            points = [(row[key], row["rms"]) for row in rows if row.get("rms") and row.get(key)]
            if points:
                axes.plot(*zip(*points, strict=True), markersize=3.5, linewidth=1.4, label=label, **look)
    for axes, label in ((by_time, "seconds of solving"), (by_shots, "shots")):
        axes.set(xscale="log", yscale="log", xlabel=label)
        axes.xaxis.set_major_formatter(FuncFormatter(lambda x, _: f"{x:,g}"))
        axes.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
        axes.yaxis.set_major_formatter(FuncFormatter(lambda y, _: f"{100 * y:g} %"))
        axes.yaxis.set_minor_formatter(NullFormatter())
        axes.grid(which="major", alpha=0.35)
        axes.grid(which="minor", alpha=0.12)
        if noise:
            axes.axhline(noise, color="0.4", linestyle=":", linewidth=1.2)
    if noise:
        by_time.annotate(
            "noise of the reference",
            (0.01, noise),
            xycoords=("axes fraction", "data"),
            va="bottom",
            color="0.4",
            size=8,
        )
    by_time.set_ylabel("relative RMS error of irradiance")
    figure.suptitle(title, fontsize=11)
    figure.legend(loc="outside right upper", frameon=False)
    _save(figure, path)


def _save(figure: Figure, path: Path) -> None:
    """Raises UserError."""
    try:
        figure.savefig(path)
    except OSError as error:
        raise UserError(f"{path}: cannot be written: {error.strerror or error}") from None


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
                points = [(row[plot.x], row[y]) for row in group]
                yield (f"{name}: {label}" if name else label), colour, style, points
