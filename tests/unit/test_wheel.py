"""The wheel, installed in a new environment outside of the checkout: commands, shaders, and the scenes that come along."""

from __future__ import annotations

import ast
import json
import os
import re
import subprocess
import sys
import sysconfig
import tomllib
from importlib.metadata import packages_distributions
from pathlib import Path

import pytest

from app import __version__
from app.scene.library import scene_names

ROOT = Path(__file__).parents[2]


class Installed:
    """A new environment with the wheel in it, used from a folder of its own."""

    def __init__(self, programs: Path, folder: Path) -> None:
        self._programs, self._folder = programs, folder
        folder.mkdir()

    def run(self, program: str, *words: str) -> str:
        """What a program of it prints."""
        free = {name: value for name, value in os.environ.items() if not name.startswith("PYTHON")}
        command = [str(self._programs / program), *words]
        done = subprocess.run(command, cwd=self._folder, capture_output=True, text=True, env=free, timeout=200)
        assert done.returncode == 0, done.stderr
        return done.stdout

    def glowtree(self, line: str) -> str:
        return self.run("glowtree", *line.split())


@pytest.fixture(scope="module")
def installed(tmp_path_factory):
    """Only its libraries are shared with this environment, by a path that does not lead to the checkout."""
    folder = tmp_path_factory.mktemp("wheel")
    pip = [sys.executable, "-m", "pip", "--disable-pip-version-check"]
    build = [*pip, "wheel", "--no-deps", "--no-build-isolation", "-w", str(folder), str(ROOT)]
    made = subprocess.run(build, capture_output=True, text=True)
    assert made.returncode == 0, made.stderr
    (wheel,) = folder.glob("*.whl")
    assert wheel.name == f"glowtree-{__version__}-py3-none-any.whl"
    subprocess.run([sys.executable, "-m", "venv", "--without-pip", str(folder / "new")], check=True)
    python = folder / "new" / "bin" / "python"
    ask = "import sysconfig; print(sysconfig.get_path('purelib'))"
    (libraries,) = subprocess.run([python, "-c", ask], capture_output=True, text=True, check=True).stdout.splitlines()
    (Path(libraries) / "libraries.pth").write_text(sysconfig.get_path("platlib"))
    subprocess.run([*pip, "--python", str(python), "install", "-q", "--no-deps", str(wheel)], check=True)
    return Installed(folder / "new" / "bin", folder / "elsewhere")


def test_it_says_its_version(installed):
    assert installed.glowtree("--version").strip() == f"glowtree {__version__}"


def test_it_lights_a_scene_and_bakes_it(installed):
    line = "cornell-box --solver gathering --texels 1000 --rays 8"
    shot = json.loads(installed.glowtree(f"shot {line} --size 64x48 -o box.png --json"))
    assert shot["rays"] == 8
    baked = json.loads(installed.glowtree(f"bake {line} -o baked --json"))
    assert len(baked["output"]) == 3


COUNT = """
import json
from app.scene.library import scene_names
from app.scene.load import load_scene
print(json.dumps({name: len(load_scene(name).triangles) for name in scene_names()}))
"""


def test_it_brings_its_scenes_along(installed):
    counts = json.loads(installed.run("python", "-c", COUNT))
    assert list(counts) == list(scene_names()) and min(counts.values()) > 0


def test_all_that_is_imported_is_asked_for():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    extras = [line for lines in project["optional-dependencies"].values() for line in lines]
    asked = {_canonical(re.split(r"[\s<>=!~\[;]", line)[0]) for line in [*project["dependencies"], *extras]}
    elsewhere = {"bpy", "pyoidn", "drjit"}  # Blender's, of a Python that the user names; what Mitsuba brings along
    owners, missing = packages_distributions(), set()
    for path in (ROOT / "app").rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            modules = [alias.name for alias in node.names] if isinstance(node, ast.Import) else []
            if isinstance(node, ast.ImportFrom) and node.level == 0 and node.module:
                modules = [node.module]
            for top in (
                {module.split(".")[0] for module in modules} - set(sys.stdlib_module_names) - {"app", *elsewhere}
            ):
                names = {_canonical(name) for name in owners.get(top, [top])}
                if not names & asked:
                    missing.add(f"{path.relative_to(ROOT)} imports {top}")
    assert missing == set()


def _canonical(name: str) -> str:
    return re.sub(r"[-_.]+", "-", name).lower()
