"""The lightmap image, its gutters, the report, and that a folder of files is written whole or not at all."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import OpenEXR
import pytest
from bake_scenes import sides_charts, sides_scene
from PIL import Image

import app.bake
from app.atlas.charts import GAP
from app.bake import prepare_directory, write_bake
from app.bake.exr import IRRADIANCE, write_exr
from app.bake.options import BakeOptions
from app.bake.read import read_irradiance
from app.bake.rgbe import rgbe
from app.errors import UserError
from app.lightmap.gutter import GUTTER, fill_gutter
from app.scene.sky_image import radiance_hdr

NAMES = ["irradiance.exr", "report.json", "scene.glb"]


@pytest.fixture
def inputs():
    """scene, charts, irradiance and coverage of a small bake."""
    scene = sides_scene()
    charts = sides_charts(scene)
    width, height = charts.size
    rng = np.random.default_rng(5)
    covered = rng.random((height, width)) < 0.5
    irradiance = rng.lognormal(0, 5, (height, width, 3)).astype(np.float32)
    irradiance[~covered] = np.nan  # must not matter
    return scene, charts, irradiance, covered


# -- image -------------------------------------------------------------------------------------------------------------


def test_exr_reads_back_exactly(tmp_path):
    values = np.random.default_rng(2).lognormal(0, 8, (5, 7, 3)).astype(np.float32)
    write_exr(tmp_path / "e.exr", values, IRRADIANCE, half=False)
    file = OpenEXR.File(str(tmp_path / "e.exr"), separate_channels=True)
    assert sorted(file.channels()) == ["B", "G", "R"]
    for c, name in enumerate("RGB"):
        np.testing.assert_array_equal(file.channels()[name].pixels, values[:, :, c])
    header = file.header()
    assert (header["quantity"], header["unit"]) == ("irradiance", "W/m2")
    assert header["compression"] == OpenEXR.ZIP_COMPRESSION
    np.testing.assert_allclose(header["chromaticities"][:2], (0.64, 0.33), rtol=1e-6)  # 32-bit floats


def test_gutter_takes_the_nearest_texel():
    rng = np.random.default_rng(4)
    covered = rng.random((40, 50)) < 0.01
    values = rng.random((40, 50, 3)).astype(np.float32)
    filled = fill_gutter(values, covered)
    y, x = np.nonzero(covered)
    for row, column in np.ndindex(40, 50):
        distance = np.hypot(y - row, x - column)
        if distance.min() > GUTTER:
            assert not filled[row, column].any()
        else:
            nearest = values[y, x][distance == distance.min()]
            assert (filled[row, column] == nearest).all(axis=1).any()


def test_bilinear_lookups_never_see_another_chart():
    """Two charts as near as charts may be, one around the other: all neighbours of a chart's texels are its own."""
    chart = np.zeros((24, 24), int)
    chart[4:20, 4:20] = 1
    chart[6:18, 6:18] = 0
    chart[6 + GAP : 18 - GAP, 6 + GAP : 18 - GAP] = 2
    filled = fill_gutter(np.repeat(chart[:, :, None], 3, 2).astype(np.float32), chart > 0)[:, :, 0]
    for dy in (-1, 0, 1):
        for dx in (-1, 0, 1):
            neighbour = np.roll(filled, (dy, dx), (0, 1))
            np.testing.assert_array_equal(neighbour[chart > 0], chart[chart > 0])


# -- folder ------------------------------------------------------------------------------------------------------------


def test_writes_three_files_and_nothing_else(tmp_path, inputs):
    files = write_bake(tmp_path / "new" / "folder", *inputs, {"shots": 3})
    assert sorted(p.name for p in files.scene.parent.iterdir()) == NAMES
    _, _, irradiance, covered = inputs
    pixels = OpenEXR.File(str(files.irradiance)).channels()["RGB"].pixels
    assert pixels.dtype == np.float32  # the numbers of this light are beyond what half floats hold, which is said
    (note,) = files.notes
    assert "half floats do not hold light of" in note
    np.testing.assert_array_equal(pixels[covered], irradiance[covered])
    assert np.isfinite(pixels).all()
    assert json.loads(files.report.read_text()) == {
        "shots": 3,
        "atlas": list(files.atlas),
        "pages": 1,
        "warnings": [note],
        "files": NAMES,
    }


def test_files_that_no_bake_wrote_stay(tmp_path, inputs):
    mine = ["embedded.glb", "index.html", "irradiance.hdr", "sky.exr"]
    for name in mine:
        (tmp_path / name).write_text("mine")
    for _ in range(2):
        write_bake(tmp_path, *inputs, {})
        assert sorted(path.name for path in tmp_path.iterdir()) == sorted([*mine, *NAMES])
    assert {(tmp_path / name).read_text() for name in mine} == {"mine"}
    (tmp_path / "report.json").write_text('{"files": ["../x", "embedded.glb", 3]}')  # nothing is done by a damaged one
    write_bake(tmp_path, *inputs, {})
    assert (tmp_path / "embedded.glb").exists()


def test_half_floats_are_right_to_a_twentieth_of_a_per_cent(tmp_path, inputs):
    scene, charts, irradiance, covered = inputs
    light = np.clip(np.nan_to_num(irradiance), 1e-3, 100.0).astype(np.float32)
    sizes = []
    for options in (BakeOptions(), BakeOptions(exr_float=True)):
        files = write_bake(tmp_path, scene, charts, light, covered, {}, options)
        assert files.notes == ()
        pixels = OpenEXR.File(str(files.irradiance)).channels()["RGB"].pixels
        np.testing.assert_allclose(pixels[covered], light[covered], rtol=2.0**-11)  # half of the last of 11 bits
        sizes.append(files.irradiance.stat().st_size)
    assert sizes[0] < 0.6 * sizes[1]


def test_parts_add_up_to_the_whole(tmp_path, inputs):
    scene, charts, irradiance, covered = inputs
    whole = np.clip(np.nan_to_num(irradiance), 1e-3, 100.0).astype(np.float32)
    direct = whole * np.random.default_rng(3).random(whole.shape).astype(np.float32)
    light = np.concatenate([whole, direct], axis=2)
    files = write_bake(tmp_path, scene, charts, light, covered, {}, BakeOptions(hdr=True, padding=6))
    names = {f"irradiance{part}{ending}" for part in ("-direct", "-indirect") for ending in (".exr", ".hdr")}
    assert {path.name for path in files.more} == names | {"irradiance.hdr"}
    read = [read_irradiance(tmp_path / f"irradiance{part}.exr") for part in ("", "-direct", "-indirect")]
    np.testing.assert_allclose(
        read[1] + read[2], read[0], rtol=2.0**-10
    )  # each is rounded by half of the last of 11 bits
    assert 0.4 < read[1].sum() / read[0].sum() < 0.6
    header = OpenEXR.File(str(tmp_path / "irradiance-direct.exr")).header()
    assert header["quantity"] == "direct irradiance"
    write_bake(tmp_path, scene, charts, whole, covered, {})
    assert sorted(path.name for path in tmp_path.iterdir()) == NAMES  # none of another bake is left


def test_rgbe_is_right_to_8_bits_of_the_brightest_colour(tmp_path, inputs):
    scene, charts, irradiance, covered = inputs
    files = write_bake(tmp_path, scene, charts, irradiance, covered, {}, BakeOptions(hdr=True, rgbe_png=True))
    assert sorted(path.name for path in files.more) == ["irradiance.hdr", "irradiance.rgbe.png"]
    exact = OpenEXR.File(str(files.irradiance)).channels()["RGB"].pixels
    packed = np.asarray(Image.open(tmp_path / "irradiance.rgbe.png")).astype(np.float64)
    decoded = (packed[..., :3] + 0.5) * 2.0 ** (packed[..., 3:] - 128 - 8)
    for read in (decoded, radiance_hdr((tmp_path / "irradiance.hdr").read_bytes())):
        assert (np.abs(read - exact).max(2) <= 2.0**-8 * exact.max(2)).all()
    write_bake(tmp_path, scene, charts, irradiance, covered, {})
    assert sorted(path.name for path in tmp_path.iterdir()) == NAMES  # none of another bake is left


def test_rgbe_of_nothing_and_of_the_extremes():
    light = np.float32([[[0, 0, 0], [1e-44, 0, 0], [1e38, 1, 0], [255.9, 255.9, 255.9]]])
    packed = rgbe(light).astype(np.float64)[0]
    read = (packed[:, :3] + 0.5) * 2.0 ** (packed[:, 3:] - 136)
    assert (packed[:2] == 0).all() and np.isfinite(read).all()
    np.testing.assert_allclose(read[2:].max(1), light[0, 2:].max(1), rtol=2.0**-7)


def test_irradiance_that_is_not_finite_is_refused(tmp_path, inputs):
    scene, charts, irradiance, covered = inputs
    irradiance[tuple(np.argwhere(covered)[0])] = np.inf
    with pytest.raises(AssertionError, match="not finite"):
        write_bake(tmp_path, scene, charts, irradiance, covered, {})
    assert not list(tmp_path.iterdir())


def test_image_of_another_size_is_refused(tmp_path, inputs):
    scene, charts, irradiance, covered = inputs
    with pytest.raises(AssertionError, match="31, 32"):
        write_bake(tmp_path, scene, charts, irradiance[1:], covered[1:], {})


@pytest.mark.parametrize("step", ["light_files.write_exr", "glb_bytes", "json_text"])
def test_failing_half_way_keeps_the_files_of_the_last_bake(tmp_path, inputs, monkeypatch, step):
    files = write_bake(tmp_path, *inputs, {"shots": 1})
    before = {path: path.read_bytes() for path in files.paths}

    def full(*args, **more):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(f"app.bake.{step}", full)
    with pytest.raises(UserError, match=r"cannot write the bake .No space left on device"):
        write_bake(tmp_path, *inputs, {"shots": 2})
    assert {path: path.read_bytes() for path in tmp_path.iterdir()} == before


def test_what_a_killed_bake_left_half_written_goes_at_the_next(tmp_path):
    for name in (
        "scene.7.glb",
        "irradiance-direct.rgbe.7.png",
        "report.7.json",
        "index.7.html",
        "mine.7.glb",
        "scene.x.glb",
    ):
        (tmp_path / f".{name}").write_text("")
    prepare_directory(tmp_path)
    assert sorted(path.name for path in tmp_path.iterdir()) == [".mine.7.glb", ".scene.x.glb"]


def test_folder_that_cannot_be_made(tmp_path, inputs):
    (tmp_path / "file").write_text("")
    for folder in (tmp_path / "file", tmp_path / "file" / "below"):
        with pytest.raises(UserError, match="cannot write here"):
            prepare_directory(folder)
        with pytest.raises(UserError, match="cannot write here"):
            write_bake(folder, *inputs, {})


def test_exr_that_cannot_be_written_is_an_os_error(tmp_path):
    with pytest.raises(OSError, match="nowhere"):
        write_exr(tmp_path / "nowhere" / "e.exr", np.zeros((2, 2, 3), np.float32), IRRADIANCE, half=True)


# -- report ------------------------------------------------------------------------------------------------------------


def test_report_is_the_same_file_for_equal_reports():
    a = {"b": 1, "a": {"y": np.float32(0.5), "x": (1, 2)}, "path": Path("x.glb")}
    b = {"path": Path("x.glb"), "a": {"x": [1, 2], "y": 0.5}, "b": np.int64(1)}
    assert app.bake.json_text(a) == app.bake.json_text(b)
    assert json.loads(app.bake.json_text(a)) == {"a": {"x": [1, 2], "y": 0.5}, "b": 1, "path": "x.glb"}


def test_report_has_no_numbers_that_json_lacks():
    text = app.bake.json_text({"residual": math.nan, "rows": np.array([1.0, np.inf])})
    assert json.loads(text, parse_constant=pytest.fail) == {"residual": None, "rows": [1.0, None]}
