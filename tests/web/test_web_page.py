"""The page that a bake brings along, opened from the disk, beside the viewer's own picture."""

from __future__ import annotations

import json
import shutil

import numpy as np
import pytest
from browser import SIZE, apart, picture_of_page
from npm import npm_package
from PIL import Image

from app.bake.web_page import find_three
from app.cli import run
from app.errors import UserError

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


SCENES = ("cornell-box", "loggia.toml --sky clear --sun 60,15")


@pytest.mark.parametrize(("scene", "pages"), [(SCENES[0], []), (SCENES[1], []), (SCENES[0], ["--max-size", "64"])])
def test_the_page_shows_what_the_viewer_shows(tmp_path, monkeypatch, scene, pages):
    packages = npm_package(THREE)
    monkeypatch.chdir(tmp_path)
    (tmp_path / "loggia.toml").write_text(LOGGIA)
    solve = [*scene.split(), "--solver", "gathering", "--texels", "4000", "--rays", "32"]
    web = ["--web", "--three", str(packages / "three")]
    assert run(["bake", *solve, "-o", str(tmp_path / "baked"), *web, *pages]) == 0
    assert run(["shot", *solve, "-o", str(tmp_path / "viewer.png"), "--size", "{}x{}".format(*SIZE)]) == 0
    (tmp_path / "alone").mkdir()
    shutil.copy(tmp_path / "baked" / "index.html", tmp_path / "alone")  # it needs no file beside it
    shown = picture_of_page(tmp_path / "alone" / "index.html", from_disk=True)
    viewer = np.asarray(Image.open(tmp_path / "viewer.png").convert("RGB"))
    assert apart(shown, viewer) < 0.02
    if "--sun" in scene:  # whose disc is two pixels wide, and all but white: nothing else is
        assert np.allclose(brightest(shown), brightest(viewer), atol=2)


def brightest(picture: np.ndarray) -> np.ndarray:
    """(row, column) of the brightest pixel, which is nearly white."""
    light = picture.min(2)
    assert light.max() > 230
    return np.array(np.unravel_index(light.argmax(), light.shape))


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
