"""False colour and exposure: numbers that come from the light."""

from __future__ import annotations

import numpy as np
import pytest
from boxes import SIZE, STEP, box, cornell, even, hits, picture, put, view_of

from app.gpu import Gpu
from app.lightmap.lightmap import Lightmap
from app.render.exposure import BRIGHT, exposure_of
from app.render.false_colour import colour_map, false_colour_scale
from app.render.options import DisplayOptions
from app.render.seen import Texels, seen_texels
from app.render.units import LUMINANCE

__all__ = ["box", "cornell"]


@pytest.mark.parametrize("logarithmic", [False, True])
@pytest.mark.parametrize("share", [0.0, 0.1, 0.5, 1.0])
def test_false_colour_is_the_colour_of_the_value(gpu: Gpu, box: Lightmap, logarithmic: bool, share: float) -> None:
    """A share of the top of the scale has the colour of the legend there, whatever the exposure."""
    high = 500.0
    put(box, "t_irradiance", even(box, (1, 1, 1)) * (share * high / 683.0))
    display = DisplayOptions(
        false_colour="illuminance", false_colour_max=high, false_colour_log=logarithmic, exposure=7
    )
    scale = false_colour_scale(display, box)
    assert scale.high == high and scale.unit == "lx"
    assert (0 < scale.low < high) if logarithmic else scale.low == 0
    low = scale.low
    place = np.log(max(share * high, low) / low) / np.log(high / low) if logarithmic else share
    expected = colour_map(1001)[round(place * 1000)]
    x, y = SIZE[0] // 2, SIZE[1] // 3
    # the legend is sampled in steps of 1/1000 here, less than half a step of 8 bits
    assert picture(gpu, box, display)[y, x] / 255 == pytest.approx(expected, abs=STEP + 0.5 / 255)


def test_the_density_layer_shows_texels_per_metre(gpu: Gpu, box: Lightmap) -> None:
    """The colour at a pixel of the back wall is that of its whole texels, whose area is known."""
    display = DisplayOptions(layer="density", exposure=7)
    low, high, unit = false_colour_scale(display, box)
    x, y = SIZE[0] // 2, SIZE[1] // 3
    (triangle,), _ = hits(box.scene, view_of(box), np.array([[x, y]]))
    surfaces = box.pool.surfaces
    on_wall = (surfaces.face >= 0) & (box.charts.face_triangle[surfaces.face] == triangle)
    density = 1 / np.sqrt(surfaces.area[on_wall].max())
    assert low < density < high and unit == "texels/m"
    expected = colour_map(1001)[round(np.log(density / low) / np.log(high / low) * 1000)]
    assert picture(gpu, box, display)[y, x] / 255 == pytest.approx(expected, abs=STEP + 0.5 / 255)


def mean_residual(lightmap: Lightmap) -> np.ndarray:
    """r̄ over all texels, RGB [W/m²]."""
    area = lightmap.pool.surfaces.area
    return np.einsum("tijc,tij->c", lightmap.residual().astype(np.float64), area) / area.sum()


def test_a_logarithmic_scale_spans_what_is_lit(box: Lightmap) -> None:
    """From what is nearly the darkest to nearly the brightest of what does not emit, however bright a lamp is."""
    rng = np.random.default_rng(7)
    lux = 10 ** rng.uniform(1, 3, box.pool.surfaces.area.shape)
    emits = np.array([m.emits for m in box.scene.materials])
    face = box.pool.surfaces.face
    lamp = emits[box.scene.material_ids[box.charts.face_triangle[face]]] & (face >= 0)
    assert lamp.any()
    lux[lamp] = 1e6
    put(box, "t_irradiance", np.repeat((lux / 683)[..., None], 3, -1))
    low, high, _ = false_colour_scale(DisplayOptions(false_colour="illuminance"), box)
    assert 8 <= low <= 12 and 900 <= high <= 1200  # 1 % and 99 % of two decades, rounded outwards to short numbers


def test_a_frame_waits_for_no_whole_ambient_term(box: Lightmap, monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[bool] = []
    monkeypatch.setattr(box, "ambient_of", lambda whole, wait: asked.append(whole))
    for whole in (False, True):
        false_colour_scale(DisplayOptions(false_colour="illuminance"), box, whole=whole)
    assert asked == [False, True]


def test_scale_and_exposure_come_from_the_light(box: Lightmap) -> None:
    H = (1.0, 2.0, 0.5)
    put(box, "t_irradiance", even(box, H))
    put(box, "t_residual", even(box, (0.0, 0.0, 0.0)))
    lux = 683 * np.array(H) @ LUMINANCE
    scale = false_colour_scale(DisplayOptions(false_colour="illuminance", false_colour_log=False), box)
    assert lux <= scale.high <= 1.5 * lux
    luminance = false_colour_scale(DisplayOptions(false_colour="luminance", false_colour_log=False), box)
    brightest = max(np.array(m.albedo) * H @ LUMINANCE for m in box.scene.materials if not m.emits)
    assert 683 / np.pi * brightest <= luminance.high <= 1.5 * 683 / np.pi * brightest
    assert luminance.unit == "cd/m²"

    seen = seen_by_first(box)
    exposure = exposure_of(box, seen, mean_residual(box))
    L = (box.albedo() * H @ LUMINANCE)[seen] / np.pi
    L = np.minimum(L[L > 0], np.quantile(L, BRIGHT))  # the lamp reflects nothing
    assert 2.0**exposure * np.exp(np.log(L).mean()) == pytest.approx(0.18, rel=1e-5)
    put(box, "t_irradiance", even(box, H) * 8)
    assert exposure_of(box, seen, mean_residual(box)) == pytest.approx(exposure - 3, abs=1e-5)


def seen_by_first(lightmap: Lightmap) -> Texels:
    camera = lightmap.scene.cameras[0]
    return seen_texels(lightmap.pool, camera.world_from_camera, camera.yfov)


def test_glare_and_darkness_do_not_change_the_exposure(box: Lightmap) -> None:
    put(box, "t_residual", even(box, (0.0, 0.0, 0.0)))
    seen = seen_by_first(box)
    rng = np.random.default_rng(3)
    lit = even(box, (1.0, 1.0, 1.0))
    put(box, "t_irradiance", lit)
    exposure = exposure_of(box, seen, np.zeros(3))
    kept = rng.random(lit.shape[:3]) < 0.5
    put(box, "t_irradiance", np.where(kept[..., None], lit, np.float32(1e-6)))
    assert exposure_of(box, seen, np.zeros(3)) == pytest.approx(exposure, abs=0.2), "half of it is next to black"
    glare = rng.random(lit.shape[:3]) < 0.005
    put(box, "t_irradiance", np.where(glare[..., None], np.float32(1e4), lit))
    assert exposure_of(box, seen, np.zeros(3)) == pytest.approx(exposure, abs=0.05)


def test_leaks_in_the_dark_are_exposed_as_dark(box: Lightmap) -> None:
    """A few texels with a thousandth of the light that is emitted, and none elsewhere; half of the texels so are a dim room."""
    put(box, "t_residual", even(box, (0.0, 0.0, 0.0)))
    seen, emitted = seen_by_first(box), np.ones(3)
    lit = even(box, (1.0, 1.0, 1.0))
    put(box, "t_irradiance", lit)
    exposure = exposure_of(box, seen, np.zeros(3), emitted)
    chance = np.random.default_rng(3).random(lit.shape[:3])[..., None]
    put(box, "t_irradiance", np.where(chance < 0.03, lit / 1000, np.float32(0)))
    assert exposure_of(box, seen, np.zeros(3), emitted) == pytest.approx(exposure, abs=1e-6)
    assert exposure_of(box, seen, 0.1 * emitted, emitted) < exposure + 5, (
        "as long as light is to come, exposed for that"
    )
    put(box, "t_irradiance", np.where(chance < 0.6, lit / 1e5, lit / 1e6))
    assert exposure_of(box, seen, np.zeros(3), emitted) > exposure + 15, "dim, and lit"


def test_what_the_camera_does_not_see_does_not_change_the_exposure(box: Lightmap) -> None:
    put(box, "t_residual", even(box, (0.0, 0.0, 0.0)))
    seen = seen_by_first(box)
    lit = even(box, (1.0, 1.0, 1.0))
    put(box, "t_irradiance", lit)
    exposure = exposure_of(box, seen, np.zeros(3))
    faces = np.unique(box.pool.surfaces.face[seen])
    hidden = ~np.isin(box.pool.surfaces.face, faces)
    assert hidden[box.pool.surfaces.face >= 0].any()
    put(box, "t_irradiance", np.where(hidden[..., None], np.float32(1e-6), lit))
    assert exposure_of(box, seen, np.zeros(3)) == pytest.approx(exposure, abs=1e-6)


def test_a_scene_just_opened_is_exposed_for_the_light_to_come(box: Lightmap) -> None:
    exposure = exposure_of(box, seen_by_first(box), mean_residual(box))
    assert np.isfinite(exposure)
    assert abs(exposure) < 4, "the lamp of the Cornell box gives about as much light as the exposure of 0 is for"
    put(box, "t_residual", even(box, (0.0, 0.0, 0.0)))
    assert exposure_of(box, seen_by_first(box), mean_residual(box)) == 0.0, "no light at all"
