"""The machine that measurements are made on: its processor, its system, how busy it is."""

from __future__ import annotations

import importlib.util
import os
import platform
import sys
from pathlib import Path


def machine() -> str:
    """Processor, cores and system."""
    return f"{processor()}, {os.cpu_count()} cores, {platform.platform()}"


def processor() -> str:
    """Its name, as far as the system says."""
    model = platform.processor() or platform.machine()
    cpuinfo = Path("/proc/cpuinfo")
    if cpuinfo.is_file():
        names = [
            line.split(":", 1)[1].strip() for line in cpuinfo.read_text().splitlines() if line[:10] == "model name"
        ]
        model = names[0] if names else model
    return model


def load() -> float | None:
    """How many processes wanted a core in the minute before this run; None where the system does not say."""
    return os.getloadavg()[0] if hasattr(os, "getloadavg") else None


def peak_memory() -> float | None:
    """The most memory that this process has had so far [MiB]; None where the system does not say."""
    if importlib.util.find_spec("resource") is None:
        return None
    import resource

    unit = 1 if sys.platform == "darwin" else 1024  # bytes
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * unit / 2**20
