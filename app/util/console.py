"""What the commands say: progress with an ETA for anything over a second, warnings, and one result."""

from __future__ import annotations

import contextlib
import sys
import threading
from collections.abc import Callable, Iterator
from typing import Any

from rich.console import Console as RichConsole
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn

from app.util.json_text import json_text

Tell = Callable[[str, float], None]  # what is being done, share done
PATIENCE = 1.0  # seconds without a bar: what is over by then needs none


class Console:
    """Progress and warnings go to stderr, the result to stdout: as text, or, ``quiet``, as JSON that holds the warnings too."""

    def __init__(self, *, quiet: bool = False) -> None:
        self._quiet = quiet
        self._rich = RichConsole(stderr=True)

    @contextlib.contextmanager
    def progress(self, title: str) -> Iterator[Tell]:
        """A bar while inside, gone afterwards; nothing where stderr is no terminal that can redraw a line."""
        if not self._rich.is_interactive:
            yield lambda text, share: None
            return
        columns = TextColumn("{task.description}"), BarColumn(), TimeElapsedColumn(), TimeRemainingColumn()
        bar = Progress(*columns, console=self._rich, transient=True, redirect_stdout=False, redirect_stderr=False)
        task = bar.add_task(title, total=1.0)
        start = threading.Timer(PATIENCE, bar.start)
        start.daemon = True
        start.start()
        try:
            yield lambda text, share: bar.update(task, description=f"{title}: {text}", completed=share)
        finally:
            start.cancel()
            start.join()  # else a bar could appear that nobody stops
            bar.stop()

    def warn(self, text: str) -> None:
        if not self._quiet:
            print(f"glowtree: note: {text}", file=sys.stderr)

    def result(self, values: dict[str, Any], text: str) -> None:
        print(json_text(values).rstrip() if self._quiet else text)
