"""The page that README shows, beside the viewer's own picture."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
from browser import SIZE, apart, picture_of_page
from npm import npm_package
from PIL import Image

from app.cli import run

README = Path(__file__).parents[2] / "README.md"
THREE = "three@0.187.0"


def test_the_page_shows_what_the_viewer_shows(tmp_path):
    packages = npm_package(THREE)
    solve = ["textured-room", "--solver", "gathering", "--texels", "6000", "--rays", "32"]
    assert run(["bake", *solve, "-o", str(tmp_path / "baked")]) == 0
    assert run(["shot", *solve, "-o", str(tmp_path / "viewer.png"), "--size", "{}x{}".format(*SIZE)]) == 0
    (page,) = re.findall(r"```html\n(<!doctype html>.*?)```", README.read_text(encoding="utf-8"), re.DOTALL)
    (tmp_path / "index.html").write_text(page, encoding="utf-8")
    (tmp_path / "node_modules").symlink_to(packages)
    shown = picture_of_page(tmp_path / "index.html")
    assert apart(shown, np.asarray(Image.open(tmp_path / "viewer.png").convert("RGB"))) < 0.02
