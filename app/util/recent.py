"""Files that were opened lately, the newest first, kept in the user's state folder."""

from __future__ import annotations

import contextlib
import json
from pathlib import Path

from app.util.files import replacing

MOST = 12
MOST_BYTES = 1 << 16


class Recent:
    """The list. file: that keeps it between runs; None: it is forgotten. What cannot be read or written is no trouble."""

    def __init__(self, file: Path | None = None) -> None:
        self._file = file
        self._paths = [] if file is None else _read(file)

    @property
    def paths(self) -> list[Path]:
        """Those that are still there."""
        return [path for path in self._paths if path.is_file()]

    def add(self, path: Path) -> None:
        """Note that this file was opened just now."""
        path = path.resolve()
        self._paths = [path, *(other for other in self._paths if other != path)][:MOST]
        if self._file is None:
            return
        with contextlib.suppress(OSError):
            self._file.parent.mkdir(parents=True, exist_ok=True)
            with replacing(self._file) as partial:
                partial.write_text(json.dumps([str(path) for path in self._paths]))

    def forget(self) -> None:
        """Remember none of them any more."""
        self._paths = []
        if self._file is not None:
            with contextlib.suppress(OSError):
                self._file.unlink(missing_ok=True)


def _read(file: Path) -> list[Path]:
    try:
        values = json.loads(file.read_bytes()[:MOST_BYTES])
    except (OSError, ValueError, RecursionError):
        return []
    texts = values if isinstance(values, list) else []
    return [Path(text) for text in texts if isinstance(text, str) and "\0" not in text][:MOST]


__all__ = ["Recent"]
