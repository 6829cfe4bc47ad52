"""``glowtree info`` and ``doctor``: what a scene would take, and what the machine lacks."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from cli_folder import folder, json_of
from scene_files import Gltf

import app.commands.info as info_module
from app.atlas import charts_cache
from app.atlas.options import AtlasOptions
from app.cli import run
from app.scene import shapes
from app.scene.gltf import outline_gltf
from app.scene.load import load_scene
from app.util import cache

__all__ = ["folder"]


@pytest.mark.parametrize("storage", ["rgba32f", "rgba16f", "fixed8"])
@pytest.mark.parametrize("scene", ["cornell-box", "textured-room"])
def test_info_foretells_the_solve(folder: Path, scene: str, storage: str, capsys: pytest.CaptureFixture[str]) -> None:
    """Texels, tiles and atlas exactly; memory within 1 %: the tables of materials are left out."""
    told = json_of(capsys, ["info", scene, "--json", "--texels", "9000", "--storage", storage])
    line = ["shot", scene, "-o", "a.png", "--size", "64x48", "--json", "--texels", "9000", "--shots", "1"]
    came = json_of(capsys, [*line, "--storage", storage])
    assert told["texels"] == came["texels"]
    assert told["atlas"] == came["atlas"]
    assert told["charts"] == came["charts"]["count"]
    assert told["memory_mib"] == pytest.approx(came["memory_mib"], rel=0.01)


def test_info_of_a_large_scene_neither_unfolds_nor_places(
    folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """A box 40 times, turned, scaled and mirrored; counts, area and density as of the whole scene, marked as estimates."""
    gltf, rng = Gltf(), np.random.default_rng(3)
    box = shapes.box((1.0, 2.0, 0.5))
    primitive = {"attributes": {"POSITION": gltf.accessor(box.positions.astype(np.float32))}, "material": 0}
    primitive["indices"] = gltf.accessor(box.triangles.astype(np.uint16).reshape(-1))
    turns = rng.normal(size=(40, 4))
    places = {
        "TRANSLATION": gltf.accessor((10 * rng.random((40, 3))).astype(np.float32)),
        "ROTATION": gltf.accessor((turns / np.linalg.norm(turns, axis=1)[:, None]).astype(np.float32)),
        "SCALE": gltf.accessor(np.repeat(rng.choice([-1.0, 0.5, 2.0], (40, 1)), 3, axis=1).astype(np.float32)),
    }
    gltf.json |= {
        "meshes": [{"primitives": [primitive]}],
        "nodes": [{"mesh": 0, "extensions": {"EXT_mesh_gpu_instancing": {"attributes": places}}}],
        "materials": [
            {
                "doubleSided": True,
                "pbrMetallicRoughness": {"baseColorFactor": [0.5, 0.5, 0.5, 1]},
                "extras": {"lightmap_scale": 3},
            }
        ],
    }
    Path("boxes.glb").write_bytes(gltf.glb())
    whole = load_scene("boxes.glb")
    exact = json_of(capsys, ["info", "boxes.glb", "--json"])
    assert exact["estimated"] == ["seconds_to_open"]

    def refuse(*_: object, **__: object) -> None:
        raise AssertionError("unfolds")

    monkeypatch.setattr(info_module, "COUNTED", 100)
    monkeypatch.setattr(info_module, "read_and_unfold", refuse)
    told = json_of(capsys, ["info", "boxes.glb", "--json"])
    area = 2 * whole.normals_areas[1].sum()
    assert told["texels"] == pytest.approx((3 * told["texels_per_metre"]) ** 2 * area)
    assert told["texels"] == pytest.approx(exact["texels"], rel=0.1)  # texels on the outlines of small rectangles
    monkeypatch.setitem(info_module.OUTLINES, ".glb", (outline_gltf, 100))
    monkeypatch.setattr(info_module, "load_scene", refuse)
    estimated = ["lit_sides", "texels_per_metre", "texels", "tiles", "memory_mib", "seconds_to_open"]
    assert told.pop("estimated") == estimated
    outlined = json_of(capsys, ["info", "boxes.glb", "--json"])
    assert outlined.pop("estimated") == ["triangles", "size_m", *estimated]
    size = whole.bounds[1] - whole.bounds[0]
    assert (outlined["size_m"] >= size - 1e-9).all() and outlined.pop("size_m") == pytest.approx(size, rel=0.2)
    assert told.pop("size_m") == pytest.approx(size)
    told["cameras"] = []  # that which a scene gets if it has none
    assert outlined.pop("texels_per_metre") == pytest.approx(told.pop("texels_per_metre"))
    assert outlined == told


def test_info_foretells_how_quadtrees_begin(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Before anything has split. Memory without the tables of leaves and materials: within 2 %."""
    told = json_of(capsys, ["info", "cornell-box", "--json", "--adaptive"])
    line = ["shot", "cornell-box", "-o", "a.png", "--size", "64x48", "--json", "--adaptive", "--shots", "1"]
    came = json_of(capsys, line)
    assert told["texels"] == came["texels"]
    assert told["memory_mib"] == pytest.approx(came["memory_mib"], rel=0.02)
    # the finest level is three below the roots. A fifth of the roots' texels lie across an outline, 82 % inside of it, and count
    # whole: 4 % more
    finest = ["info", "cornell-box", "--json", "--density", str(2**3 * told["texels_per_metre"])]
    assert told["texels_if_uniform"] == pytest.approx(json_of(capsys, finest)["texels"], rel=0.04)


def test_a_budget_that_is_reached_is_said(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    line = [
        "shot",
        "cornell-box",
        "-o",
        "a.png",
        "--size",
        "64x48",
        "--adaptive",
        "--budget",
        "65536",
        "--gradient",
        "1e-3",
    ]
    assert run([*line, "--texels", "16000", "--shots", "200"]) == 0
    assert "the budget of 65,536 texels is reached" in capsys.readouterr().err


def test_info_as_text(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["info", "two-rooms"]) == 0
    rows = dict(line.strip().split("  ", 1) for line in capsys.readouterr().out.splitlines())
    assert rows["cameras"] == "main, lit room"
    assert rows["emitting materials"] == "1"


def test_doctor_lists_what_is_there(capsys: pytest.CaptureFixture[str]) -> None:
    values = json_of(capsys, ["doctor", "--json"])
    assert values["missing"] == []
    assert values["renderer"] and values["numpy"]


def test_doctor_names_packages_that_are_missing(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("app.commands.doctor.PACKAGES", ("numpy", "no-such-package"))
    assert run(["doctor"]) == 2
    assert "missing package no-such-package: " in (out := capsys.readouterr().out)
    assert out.rstrip().endswith("-m pip install no-such-package")


def test_info_of_a_large_scene_says_what_cutting_found_where_that_is_kept(
    folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """A carpet in the plane of the floor: it is cut out of that."""
    monkeypatch.setattr(info_module, "COUNTED", 1)
    monkeypatch.setattr(charts_cache, "FEWEST", 1)
    squares = ("-2 0 -2", "-2 0 2", "2 0 2", "2 0 -2"), ("-1 0 -1", "-1 0 1", "1 0 1", "1 0 -1")
    lines = [f"v {corner}" for square in squares for corner in square] + ["f 1 2 3 4", "usemtl carpet", "f 5 6 7 8"]
    Path("room.obj").write_text("\n".join(lines))
    line = ["info", "room.obj", "--light", "--unit", "m", "--up", "y", "--texels", "500", "--json"]
    with cache.elsewhere(folder):
        told = json_of(capsys, line)
        assert "overlap" in told["not_checked_here"] and not any("same plane" in note for note in told["warnings"])
        charts_cache.charts_of(load_scene("room.obj", default_light=True), AtlasOptions(texels=500))
        told = json_of(capsys, line)
    assert "not_checked_here" not in told and any("same plane" in note for note in told["warnings"])
