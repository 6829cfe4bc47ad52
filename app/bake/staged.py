"""Files that are written beside their final names first and take these together, once all are on the disk, so that a failure
leaves what was there."""

from __future__ import annotations

import os
import re
from collections.abc import Callable
from pathlib import Path
from types import TracebackType

PARTIAL = re.compile(r"\.(.+)\.\d+(\.\w+)")


def remove_partials(folder: Path, ours: Callable[[str], bool]) -> None:
    """Remove what writes that were killed have left of files with names that are ``ours``."""
    for path in folder.iterdir():
        partial = PARTIAL.fullmatch(path.name)
        if partial is not None and ours("".join(partial.groups())):
            path.unlink(missing_ok=True)


class Staged:
    """A folder's new files, in a ``with`` block: they are there once it ends without an exception, and none of them otherwise."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._written: dict[Path, Path] = {}

    def __call__(self, name: str) -> Path:
        """Where to write what shall be called so."""
        path = self._folder / name
        self._written[path] = path.with_name(f".{path.stem}.{os.getpid()}{path.suffix}")
        return self._written[path]

    def read(self, *names: str) -> dict[str, bytes]:
        """What was written so far of files of these names, by name."""
        found = {path.name: written for path, written in self._written.items() if path.name in names}
        return {name: written.read_bytes() for name, written in found.items()}

    @property
    def paths(self) -> list[Path]:
        """The final names, in the order in which they were asked for."""
        return list(self._written)

    def __enter__(self) -> Staged:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        try:
            if kind is None:
                for written in self._written.values():
                    with written.open("rb+") as file:
                        os.fsync(file.fileno())
                for path, written in self._written.items():
                    os.replace(written, path)
        finally:
            for written in self._written.values():
                written.unlink(missing_ok=True)
