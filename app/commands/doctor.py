"""``glowtree doctor``: which context this machine gives, and what is missing with the command that installs it."""

from __future__ import annotations

import argparse
import ctypes.util
import importlib.metadata
import os
import platform
import sys
from typing import Any

from app import __version__
from app.errors import GpuError
from app.gpu import gpu_context
from app.util.console import Console

PACKAGES = ("moderngl", "moderngl-window", "imgui-bundle", "numpy", "trimesh", "xatlas", "OpenEXR")
LIBRARIES = {"EGL": "libegl1", "GL": "libgl1"}  # library: Debian's package


def doctor(flags: argparse.Namespace) -> int:
    """Print what is there. Returns 0 if glowtree can run here headless, else 2."""
    values: dict[str, Any] = {
        "glowtree": __version__,
        "python": sys.version.split()[0],
        "platform": platform.platform(),
    }
    if sys.platform.startswith("linux"):
        values["display"] = os.environ.get("DISPLAY") or "none: headless commands only"
    missing = []
    for name in PACKAGES:
        try:
            values[name] = importlib.metadata.version(name)
        except importlib.metadata.PackageNotFoundError:
            missing.append(f"missing package {name}: {sys.executable} -m pip install {name}")
    try:
        with gpu_context() as gpu:
            limits = gpu.limits
            values |= {
                "renderer": limits.renderer,
                "vendor": limits.vendor,
                "opengl": limits.version,
                "largest texture": limits.max_texture,
                "compute shaders": "yes" if limits.compute else "no (not needed yet)",
                "rasteriser": "software" if gpu.software else "hardware",
            }
    except GpuError as error:
        missing += [str(error), *_libraries()]
    values["missing"] = missing
    text = "\n".join(f"{name:>18}  {value}" for name, value in values.items() if name != "missing")
    verdict = "\n".join(missing) if missing else "Everything that is needed is there."
    Console(quiet=flags.json).result(values, f"{text}\n\n{verdict}")
    return 2 if missing else 0


def _libraries() -> list[str]:
    """What may be the reason that there is no context. A loader can also find them where this does not look."""
    if not sys.platform.startswith("linux"):
        return []
    absent = [package for library, package in LIBRARIES.items() if ctypes.util.find_library(library) is None]
    return [f"missing libraries, on Debian: apt-get install {' '.join(absent)} libgl1-mesa-dri"] if absent else []
