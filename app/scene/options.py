"""In what unit a file counts lengths, and which way is up in it."""

from __future__ import annotations

from dataclasses import dataclass

from app.options import Options, option

UNITS = {"m": 1.0, "cm": 0.01, "mm": 0.001, "in": 0.0254, "ft": 0.3048}  # m
GUESSED = "auto"


@dataclass(frozen=True)
class FileOptions(Options):
    unit: str = option(
        GUESSED, "what lengths in the file are counted in; guessed where plain", choices=(GUESSED, *UNITS)
    )
    up: str = option(
        GUESSED, "the axis that points upwards in the file; guessed where plain", choices=(GUESSED, "y", "z")
    )
