"""What the desktop does for a program."""

from __future__ import annotations

import contextlib
import os
import subprocess
import sys
from pathlib import Path


def show_folder(folder: Path) -> None:
    """Open a folder in the desktop's file manager. Where there is none, nothing comes of it."""
    opener = {"darwin": "open", "win32": "explorer"}.get(sys.platform, "xdg-open")
    with contextlib.suppress(OSError):
        subprocess.Popen([opener, os.fspath(folder)], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)


__all__ = ["show_folder"]
