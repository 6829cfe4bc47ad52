"""Packages of npm that tests need, installed once into build/."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import pytest

BUILD = Path(__file__).parents[1] / "build"


def npm_package(package: str) -> Path:
    """The folder ``node_modules`` with a package (``name@version``); the test is skipped where it cannot be installed."""
    name = package.rsplit("@", 1)[0]
    folder = BUILD / name
    if not (folder / "node_modules" / name).is_dir():
        if not (shutil.which("node") and shutil.which("npm")):
            pytest.skip("node and npm are not installed")
        folder.mkdir(parents=True, exist_ok=True)
        install = ["npm", "install", "--no-fund", "--no-audit", "--prefix", str(folder), package]
        try:
            subprocess.run(install, check=True, capture_output=True, timeout=120)
        except (subprocess.CalledProcessError, subprocess.TimeoutExpired) as error:
            pytest.skip(f"{package} cannot be installed: {error}")
    return folder / "node_modules"
