"""What the commands say: progress with an ETA for anything over a second, warnings, and one result."""

from __future__ import annotations

import contextlib
import json
import sys
from collections.abc import Callable, Iterator
from typing import Any

from rich.console import Console as RichConsole
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn

Tell = Callable[[str, float], None]  # what is being done, share done


class Console:
    """Progress and warnings go to stderr, the result to stdout: as text, or as JSON with ``quiet``."""

    def __init__(self, *, quiet: bool = False) -> None:
        self._quiet = quiet
        self._rich = RichConsole(stderr=True)

    @contextlib.contextmanager
    def progress(self, title: str) -> Iterator[Tell]:
        """A bar while inside, gone afterwards; nothing where stderr is no terminal."""
        if self._quiet or not self._rich.is_terminal:
            yield lambda text, share: None
            return
        columns = TextColumn("{task.description}"), BarColumn(), TimeElapsedColumn(), TimeRemainingColumn()
        with Progress(*columns, console=self._rich, transient=True) as bar:
            task = bar.add_task(title, total=1.0)
            yield lambda text, share: bar.update(task, description=f"{title}: {text}", completed=share)

    def warn(self, text: str) -> None:
        if not self._quiet:
            print(f"glowtree: note: {text}", file=sys.stderr)

    def result(self, values: dict[str, Any], text: str) -> None:
        print(json.dumps(values, indent=2) if self._quiet else text)
