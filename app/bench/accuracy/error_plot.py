"""Error curves as a plot: relative RMS over seconds and over work; needs matplotlib, which only the extra ``bench`` installs."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from pathlib import Path

from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

from app.bench.figures import new_figure, save
from app.util.tables import Row

SIZE = (12.0, 5.0)  # inches
PEER = "0.25"  # grey
MARKERS = "osD^vP<>Xph"


def draw_curves(
    path: Path,
    title: str,
    curves: Mapping[str, list[Row]],
    peers: Collection[str],
    noise: float | None,
    units: Sequence[str],
) -> None:
    """Write one PNG: relative RMS over seconds and over work, one line for each curve by its label, dashed for those of peers;
    noise: of what is compared with, drawn as a floor; units: in which work is counted. Raises UserError."""
    figure = new_figure(*SIZE)
    by_time, by_work = figure.subplots(1, 2, sharey=True)
    for k, (name, rows) in enumerate(curves.items()):
        peer = name in peers
        look = {
            "color": PEER if peer else f"C{k}",
            "linestyle": "--" if peer else "-",
            "marker": MARKERS[k % len(MARKERS)],
        }
        for axes, key, label in ((by_time, "seconds", name), *((by_work, unit, None) for unit in units)):
            points = [(row[key], row["rms"]) for row in rows if row.get("rms") and row.get(key)]
            if points:
                axes.plot(*zip(*points, strict=True), markersize=3.5, linewidth=1.4, label=label, **look)
    for axes, label in ((by_time, "seconds of solving"), (by_work, ", ".join(units))):
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
    save(figure, path)
