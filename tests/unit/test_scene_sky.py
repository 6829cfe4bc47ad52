"""Skies: directions, the clear sky and the sun, maps that are read, and how a scene asks for one."""

from __future__ import annotations

import datetime
import math
from pathlib import Path

import numpy as np
import OpenEXR
import pytest
from scene_files import written

from app.cli import build_parser
from app.commands.flags import sky_of
from app.direct_light.sky_map import NORMALS, chances, irradiance_table
from app.errors import SceneError
from app.scene.authored import load_authored
from app.scene.colorimetry import LUMENS_PER_WATT
from app.scene.images import ImageError
from app.scene.load import load_scene
from app.scene.model import F32
from app.scene.sky import Sky, Sun, directions, solid_angles
from app.scene.sky_image import read_sky_image
from app.scene.sun_position import sun_at

LUMINANCE = np.array([0.2126, 0.7152, 0.0722])
FLOOR = (
    '[[material]]\nname = "paint"\n'
    '[[quad]]\nmaterial = "paint"\norigin = [0, 0, 0]\nedge_u = [2, 0, 0]\nedge_v = [0, 0, -3]\n'
)
AXES = np.array([[0, 1, 0], [0, -1, 0], [1, 0, 0], [0, 0, -1]], np.float64)


def test_azimuths_go_from_north_over_east() -> None:
    ways = [Sun(azimuth, height).direction for azimuth, height in ((0, 0), (90, 0), (180, 30), (17, 90))]
    assert np.allclose(ways, [[0, 0, -1], [1, 0, 0], [0, 0.5, math.sqrt(0.75)], [0, 1, 0]])
    grid = directions(8, 4)
    assert np.allclose(np.linalg.norm(grid, axis=-1), 1) and grid[0, 0, 1] > 0.9
    east = np.degrees(np.arctan2(grid[1, :, 0], -grid[1, :, 2])) % 360
    assert np.allclose(east, 22.5 + 45 * np.arange(8))
    assert solid_angles(8, 4).sum() * 8 == pytest.approx(4 * np.pi)


def test_the_sun_stands_where_the_almanac_has_it() -> None:
    """The example of NREL's solar position algorithm (Reda & Andreas 2004, table A5.1), whose angle from the zenith, 50.11162°,
    has a refraction of 0.0161° in it."""
    time = datetime.datetime(2003, 10, 17, 12, 30, 30, tzinfo=datetime.timezone(datetime.timedelta(hours=-7)))
    sun = sun_at(time, 39.742476, -105.1786)
    assert (sun.azimuth, sun.height) == pytest.approx((194.34024, 90 - 50.11162 - 0.0161), abs=0.01)


def test_what_normals_receive() -> None:
    """Of an even sky π, of its upper half alone π, 0 and π/2."""
    assert np.allclose(Sky().shape_irradiance(AXES), np.pi)
    upper = np.zeros((64, 128, 3), np.float32)
    upper[:32] = 1
    half = Sky("image", image=upper).shape_irradiance(AXES)
    assert np.allclose(half, np.pi * np.array([1, 0, 0.5, 0.5])[:, None], atol=1e-3)  # by pixels of 3°
    table = irradiance_table(Sky("image", image=upper))
    assert np.allclose(table[NORMALS // 2, -1, :3], np.pi / 2, atol=1e-3)  # x = 1
    assert np.allclose(table[-1, NORMALS // 2, :3], np.pi, atol=1e-3)  # y = 1


def test_the_clear_sky_is_brightest_at_the_sun_and_blue_away_from_it() -> None:
    sky = Sky("clear", sun=Sun(135, 40))
    ways = directions(256, 128)
    light = sky.radiance @ LUMINANCE
    brightest = ways.reshape(-1, 3)[light.argmax()]
    assert brightest @ sky.sun.direction > math.cos(math.radians(3))  # type: ignore[union-attr]
    red, _, blue = sky.radiance[0].mean(0)
    assert blue > 2 * red
    # kcd/m² at the zenith [Preetham99, A.2]
    chi = (4 / 9 - 2.5 / 120) * (np.pi - 2 * math.radians(50))
    zenith = (4.0453 * 2.5 - 4.9710) * math.tan(chi) - 0.2155 * 2.5 + 2.4192
    assert light[0].mean() * LUMENS_PER_WATT / 1000 == pytest.approx(zenith, rel=0.02)  # the first row is 0.7° from it


def test_the_sun_reddens_and_fades_as_it_sinks() -> None:
    """Of a high one 90 to 100 klx are measured; below the horizon there is none."""
    light = [Sky(sun=Sun(0, height)).sun_irradiance for height in (70, 20, 5)]
    lux = [float(E @ LUMINANCE) * LUMENS_PER_WATT for E in light]
    assert 85e3 < lux[0] < 105e3 and lux[0] > lux[1] > lux[2] > 0
    assert np.all(np.diff([E[0] / E[2] for E in light]) > 0)
    assert not Sky(sun=Sun(0, -1)).sun_irradiance.any()


def test_directions_are_chosen_by_light() -> None:
    shape = np.full((16, 32, 3), 0.1, np.float32)
    shape[3, 7] = 100
    rows, columns = chances(shape)
    assert rows[0, -1, 0] == 1 and (columns[:, -1, 0] == 1).all()
    row = np.diff(rows[0, :, 0], prepend=0)
    assert columns[..., 1].mean() == pytest.approx(1, rel=1e-5)  # a density
    assert row[3] * np.diff(columns[3, :, 0], prepend=0)[7] > 0.3  # and what lies between it and its neighbours


# -- maps --------------------------------------------------------------------------------------------------------------


def rgbe(pixels: F32, *, runs: bool) -> bytes:
    """A Radiance picture of whole powers of two, so that nothing is rounded but by half a step."""
    exponent = np.frexp(pixels.max(2))[1]
    scaled = np.floor(pixels / np.ldexp(1.0, exponent - 8)[..., None])
    packed = np.concatenate([scaled, exponent[..., None] + 128], -1).astype(np.uint8)
    height, width = exponent.shape
    body = b""
    for row in packed:
        if not runs:
            body += row.tobytes()
            continue
        body += bytes([2, 2, width >> 8, width & 255])
        for part in row.T:
            half = width // 2
            body += (
                bytes([128 + half, part[0]])
                if (part[:half] == part[0]).all()
                else bytes([half]) + part[:half].tobytes()
            )
            body += bytes([width - half]) + part[half:].tobytes()
    return b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y %d +X %d\n" % (height, width) + body


@pytest.mark.parametrize("runs", [False, True])
def test_radiance_pictures(tmp_path: Path, runs: bool) -> None:
    pixels = np.ones((8, 16, 3), np.float32)
    pixels[2, 9:] = (64, 0.5, 2)
    (tmp_path / "sky.hdr").write_bytes(rgbe(pixels, runs=runs))
    assert np.allclose(read_sky_image(tmp_path / "sky.hdr"), pixels, rtol=1 / 256, atol=64 / 256)


def test_radiance_pictures_with_runs_of_old_and_an_exposure(tmp_path: Path) -> None:
    """A row of 600 pixels that are alike is one, and runs of 87 and of 2 · 256."""
    one, other = [128, 64, 32, 129], [128, 128, 128, 130]
    alike = bytes([*one, 1, 1, 1, 87, 1, 1, 1, 2])
    mixed = bytes([*one, 1, 1, 1, 255, *other, 1, 1, 1, 255, *one, 1, 1, 1, 87])
    head = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\nEXPOSURE=4.0\nEXPOSURE= 0.5\n\n-Y 301 +X 600\n"
    (tmp_path / "old.hdr").write_bytes(head + alike + mixed + 299 * alike)
    pixels = read_sky_image(tmp_path / "old.hdr")
    assert pixels.shape == (301, 600, 3)
    light = np.array([128.5, 64.5, 32.5]) / 128 / 2
    assert np.allclose(pixels[[0, 2, 300]], light) and np.allclose(pixels[1, :256], light)
    assert np.allclose(pixels[1, 256:512], 128.5 / 64 / 2) and np.allclose(pixels[1, 512:], light)


def test_suns_beyond_half_floats_do_not_go_out(tmp_path: Path) -> None:
    pixels = np.ones((8, 16, 3), np.float16)
    pixels[2, 3], pixels[4, 4] = np.inf, np.nan
    OpenEXR.File({"type": OpenEXR.scanlineimage}, {"RGB": pixels}).write(str(tmp_path / "sky.exr"))
    read = read_sky_image(tmp_path / "sky.exr")
    assert (read[2, 3] == 65504).all() and (read[4, 4] == 0).all() and (read[0] == 1).all()


def test_openexr_pictures(tmp_path: Path) -> None:
    pixels = np.linspace(0, 9, 8 * 16 * 3, dtype=np.float32).reshape(8, 16, 3)
    OpenEXR.File({"type": OpenEXR.scanlineimage}, {"RGB": pixels}).write(str(tmp_path / "sky.exr"))
    assert np.array_equal(read_sky_image(tmp_path / "sky.exr"), pixels)


def test_broken_maps_are_said(tmp_path: Path) -> None:
    whole = rgbe(np.ones((8, 16, 3), np.float32), runs=True)
    for name, data in (("cut.hdr", whole[:-9]), ("no.hdr", b"P6 1 1"), ("no.exr", b"v/1"), ("square.hdr", b"")):
        if name == "square.hdr":
            data = rgbe(np.ones((8, 8, 3), np.float32), runs=False)
        (tmp_path / name).write_bytes(data)
        with pytest.raises(ImageError, match="it ends within row 8 of 8" if name == "cut.hdr" else None):
            read_sky_image(tmp_path / name)


# -- asked for ---------------------------------------------------------------------------------------------------------


def test_a_scene_has_a_sky(tmp_path: Path) -> None:
    scene = load_authored(written(tmp_path, "a.toml", FLOOR + "[sky]\ncolour = [1, 2, 3]\nstrength = 2\n"))
    assert scene.sky is not None and scene.emits and np.array_equal(scene.sky.radiance, [[[2, 4, 6]]])
    place = "{ time = 2003-10-17T12:30:30-07:00, latitude = 39.742476, longitude = -105.1786 }"
    sky = load_authored(written(tmp_path, "b.toml", FLOOR + f'[sky]\nkind = "clear"\nsun = {place}\n')).sky
    assert sky is not None and sky.sun is not None and sky.sun.azimuth == pytest.approx(194.34, abs=0.01)
    (tmp_path / "map.hdr").write_bytes(rgbe(np.ones((8, 16, 3), np.float32), runs=False))
    sky = load_authored(
        written(tmp_path, "c.toml", FLOOR + '[sky]\nkind = "image"\nfile = "map.hdr"\nrotate = 90\n')
    ).sky
    assert sky is not None and sky.shape.shape == (8, 16, 3)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ('kind = "clear"', "needs a sun"),
        ('kind = "image"', "needs a file"),
        ('kind = "image"\nfile = "no.hdr"', "no file 'no.hdr'"),
        ('kind = "clear"\nsun = { azimuth = 1 }', "either azimuth and height"),
        ('kind = "clear"\nsun = { azimuth = 1, height = 0 }', "height"),
        ("sun = { time = 2026-01-01T00:00:00Z, latitude = 50, longitude = 10 }", "below the horizon"),
        ("strength = -1", "strength"),
    ],
)
def test_what_a_sky_lacks_is_said(tmp_path: Path, text: str, said: str) -> None:
    with pytest.raises(SceneError, match=said):
        load_authored(written(tmp_path, "a.toml", f"{FLOOR}[sky]\n{text}\n"))


def test_flags_give_a_sky_to_a_scene_without_one(tmp_path: Path) -> None:
    def asked(*flags: str) -> Sky | None:
        return sky_of(build_parser().parse_args(["shot", "x", "-o", "y", *flags]))

    assert asked() is None
    even, clear, sunny = asked("--sky", "#ff8000"), asked("--sky", "clear"), asked("--sun", "350,5.5")
    assert even is not None and even.colour == pytest.approx((1, 0.2159, 0), abs=1e-3)
    assert clear is not None and clear.sun is not None and sunny is not None and sunny.sun == Sun(350, 5.5)
    path = written(tmp_path, "a.toml", FLOOR)
    assert load_scene(path, sky=even).sky is even and NO_WARNING == load_scene(path, sky=even).warnings
    own = written(tmp_path, "b.toml", FLOOR + "[sky]\n")
    assert load_scene(own, sky=even).sky is not even


NO_WARNING: tuple[str, ...] = ()


@pytest.mark.parametrize("flags", [("--sky", "blue"), ("--sky", "no.hdr"), ("--sun", "1"), ("--sun", "1,-3")])
def test_flags_that_are_none(flags: tuple[str, str], capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as ended:
        build_parser().parse_args(["shot", "x", "-o", "y", *flags])
    assert ended.value.code == 2 and capsys.readouterr().err.count("\n") == 1


def test_a_scene_keeps_its_own_sky_and_says_so(tmp_path: Path) -> None:
    path = written(tmp_path, "a.toml", FLOOR + '[sky]\nkind = "uniform"\n')
    scene = load_scene(path, sky=Sky("clear", sun=Sun(0, 30)))
    assert scene.sky is not None and scene.sky.kind == "uniform"
    assert any("a sky of its own" in warning for warning in scene.warnings)
    assert not load_scene(path).warnings
