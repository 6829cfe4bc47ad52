"""Figures for plots, and how they are written; needs matplotlib, which only the extra ``bench`` installs."""

from __future__ import annotations

from pathlib import Path

from matplotlib.figure import Figure

from app.errors import UserError

DPI = 150


def new_figure(width: float, height: float) -> Figure:
    """Of so many inches."""
    return Figure((width, height), dpi=DPI, layout="constrained")


def save(figure: Figure, path: Path) -> None:
    """Raises UserError."""
    try:
        figure.savefig(path)
    except OSError as error:
        raise UserError(f"{path}: cannot be written: {error.strerror or error}") from None
