"""Processes that tests start and interrupt."""

from __future__ import annotations

import contextlib
import signal
import subprocess
from collections.abc import Iterator, Sequence
from pathlib import Path


@contextlib.contextmanager
def started(command: Sequence[str], env: dict[str, str], folder: Path | None = None) -> Iterator[subprocess.Popen[str]]:
    """A process whose output is read, on a system that has signals. It hears Ctrl-C also where the tests do not, as of a shell
    that started them in the background; it is gone afterwards."""
    worker = subprocess.Popen(
        command,
        cwd=folder,
        env=env,
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
    )
    try:
        yield worker
    finally:
        if worker.poll() is None:
            worker.kill()
        worker.communicate()
