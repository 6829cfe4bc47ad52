"""Bakes in a browser, beside the viewer's own picture: the page that a bake brings along, opened from the disk; the page that
README shows; and the standard file with light in its pictures, in a viewer that knows nothing of lightmaps."""

from __future__ import annotations

import json
import re
import shutil
import struct
from pathlib import Path

import numpy as np
import pytest
from browser import SIZE, apart, pictures_of_pages, served
from khronos import validator_messages
from npm import npm_package
from PIL import Image

from app.bake.web_page import find_three
from app.cli import run
from app.errors import UserError

README = Path(__file__).parents[2] / "README.md"
THREE = "three@0.187.0"
LOGGIA = """
material = [{ name = "plaster", albedo = [0.7, 0.6, 0.5] }]
box = [
  { material = "plaster", center = [0, 1.5, 0], size = [4, 3, 4], inside = true, without = ["right", "back"] },
  { material = "plaster", center = [0.8, 0.5, -0.5], size = [0.6, 1, 0.6], without = ["bottom"] },
]

[[camera]]
name = "out"
position = [-1.6, 1.7, 1.6]
target = [0.8, 1.3, -0.8]
yfov_deg = 70
"""
EMBEDDED = """<!doctype html>
<style>body { margin: 0; background: #212224 }</style>
<script type="importmap">
  { "imports": { "three": "./node_modules/three/build/three.module.js", "three/addons/": "./node_modules/three/examples/jsm/" } }
</script>
<script type="module">
  import * as THREE from 'three';
  import { GLTFLoader } from 'three/addons/loaders/GLTFLoader.js';

  const gltf = await new GLTFLoader().loadAsync('baked/embedded.glb');
  const renderer = new THREE.WebGLRenderer({ antialias: true, alpha: true });
  renderer.setSize(innerWidth, innerHeight);
  document.body.append(renderer.domElement);
  const camera = gltf.cameras[0];
  camera.aspect = innerWidth / innerHeight;
  camera.updateProjectionMatrix();
  renderer.render(gltf.scene, camera);
</script>
"""
BAKES = {
    "cornell-box": ["cornell-box", "--web", "--embed"],
    "loggia": ["loggia.toml", "--sky", "clear", "--sun", "60,15", "--web"],
    "pages": ["cornell-box", "--web", "--max-size", "64"],
    "textured-room": ["textured-room", "--embed"],
}
SOLVE = ["--solver", "gathering", "--texels", "4000", "--rays", "32"]
WEB = [name for name, line in BAKES.items() if "--web" in line]
EMBED = [name for name, line in BAKES.items() if "--embed" in line]


@pytest.fixture(scope="module")
def baked(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a folder for each of BAKES, and three.js in each."""
    folder = tmp_path_factory.mktemp("web")
    packages = npm_package(THREE)
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        Path("loggia.toml").write_text(LOGGIA)
        for name, line in BAKES.items():
            web = ["--three", str(packages / "three")] if "--web" in line else []
            assert run(["bake", *line, *web, *SOLVE, "-o", f"{name}/baked"]) == 0
            Path(name, "node_modules").symlink_to(packages)
    return folder


@pytest.fixture(scope="module")
def shown(baked: Path) -> dict[tuple[str, str], np.ndarray]:
    """The picture of each page, by kind and scene."""
    pages: dict[tuple[str, str], str] = {}
    with served(baked) as address:
        for name in WEB:
            (baked / name / "alone").mkdir()
            page = shutil.copy(
                baked / name / "baked" / "index.html", baked / name / "alone"
            )  # it needs no file beside it
            pages["web", name] = Path(page).as_uri()
        for name in EMBED:
            (baked / name / "embedded.html").write_text(EMBEDDED)
            pages["embedded", name] = f"{address}/{name}/embedded.html"
        (page,) = re.findall(r"```html\n(<!doctype html>.*?)```", README.read_text(encoding="utf-8"), re.DOTALL)
        (baked / "textured-room" / "index.html").write_text(page, encoding="utf-8")
        pages["readme", "textured-room"] = f"{address}/textured-room/index.html"
        return dict(zip(pages, pictures_of_pages(list(pages.values()), baked), strict=True))


def viewers_picture(baked: Path, name: str, *display: str) -> np.ndarray:
    """Of the same solve."""
    scene = [word for word in BAKES[name] if word not in ("--web", "--embed", "--max-size", "64")]
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(baked)
        assert run(["shot", *scene, *SOLVE, *display, "-o", "viewer.png", "--size", "{}x{}".format(*SIZE)]) == 0
        return np.asarray(Image.open("viewer.png").convert("RGB"))


@pytest.mark.parametrize("name", WEB)
def test_the_page_shows_what_the_viewer_shows(baked, shown, name):
    viewer = viewers_picture(baked, name)
    assert apart(shown["web", name], viewer) < 0.02
    if "--sun" in BAKES[name]:  # whose disc is two pixels wide, and all but white: nothing else is
        assert np.allclose(brightest(shown["web", name]), brightest(viewer), atol=2)


def brightest(picture: np.ndarray) -> np.ndarray:
    """(row, column) of the brightest pixel, which is nearly white."""
    light = picture.min(2)
    assert light.max() > 230
    return np.array(np.unravel_index(light.argmax(), light.shape))


def test_the_page_of_the_readme_shows_what_the_viewer_shows(baked, shown):
    assert apart(shown["readme", "textured-room"], viewers_picture(baked, "textured-room")) < 0.02


@pytest.mark.parametrize("name", EMBED)
def test_any_viewer_shows_the_embedded_file_lit(baked, shown, name):
    exposure = json.loads((baked / name / "baked" / "report.json").read_text())["exposure"]
    lit = viewers_picture(baked, name, "--tone-map", "clamp", "--exposure", str(exposure))
    assert apart(shown["embedded", name], lit) < 0.02


@pytest.mark.parametrize("name", EMBED)
def test_the_embedded_file_is_standard(baked, name):
    embedded = baked / name / "baked" / "embedded.glb"
    assert [message for message in validator_messages(embedded) if message["severity"] < 2] == []
    data = embedded.read_bytes()
    (length,) = struct.unpack_from("<I", data, 12)
    assert "extensionsUsed" not in json.loads(data[20 : 20 + length])


def test_without_three_one_line_says_so_before_any_work(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert run(["bake", "cornell-box", "-o", "out", "--web"]) == 2
    assert "npm install three" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("package", ["", "{", json.dumps({"version": 3}), json.dumps({"version": "0.140.1"})])
def test_what_is_no_three_or_too_old_is_refused(tmp_path, package):
    (tmp_path / "package.json").write_text(package)
    with pytest.raises(UserError, match="--web: "):
        find_three(str(tmp_path))
