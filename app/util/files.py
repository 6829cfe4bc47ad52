"""Files that are whole or not there."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Iterator
from pathlib import Path


@contextlib.contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """A name beside ``path`` to write to, which takes its place in the end, once it is on the disk. Raises OSError."""
    partial = path.with_name(f"{_prefix(path)}{os.getpid()}")
    try:
        yield partial
        with partial.open("rb+") as written:
            os.fsync(written.fileno())
        partial.replace(path)
        _sync_folder(path.parent)
    finally:
        partial.unlink(missing_ok=True)


def partials_of(path: Path) -> list[Path]:
    """What writes of ``path`` that were killed have left beside it."""
    return [one for one in path.parent.glob("*") if one.name.startswith(_prefix(path)) and one.suffix[1:].isdigit()]


def _prefix(path: Path) -> str:
    return f".{path.name}."


def _sync_folder(folder: Path) -> None:
    """Let the new name be on the disk, too, where the system can say so."""
    if hasattr(os, "O_DIRECTORY"):
        descriptor = os.open(folder, os.O_DIRECTORY)
        try:
            os.fsync(descriptor)
        finally:
            os.close(descriptor)
