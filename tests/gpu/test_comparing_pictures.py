"""Pictures beside a reference: errors in colours, and the split view."""

from __future__ import annotations

import numpy as np
import pytest
from boxes import PLAIN, SIZE, STEP, box, cornell, even, light_of, picture, put, put_ambient, smooth

from app.compare.reference_texels import ReferenceTexels
from app.gpu import Gpu
from app.lightmap.lightmap import Lightmap
from app.render.false_colour import ERRORS, colour_map
from app.render.resolve import Reference
from app.scene.model import F64

__all__ = ["box", "cornell"]


def reference_of(gpu: Gpu, box: Lightmap, tiles: F64) -> tuple[ReferenceTexels, Reference]:
    texels = ReferenceTexels(gpu, box, light_of(box, tiles.astype(np.float32)))
    texels.follow(whole=True)
    return texels, Reference(texels.texture, 1e-3)


@pytest.mark.parametrize("share", [0.0, 0.001, 0.03, 0.5, 3.0])
def test_the_error_has_the_colour_of_its_value(gpu: Gpu, box: Lightmap, share: float) -> None:
    H = np.array([2.0, 1.0, 0.5])
    texels, reference = reference_of(gpu, box, even(box, tuple(H)))
    put(box, "t_irradiance", even(box, tuple(H * (1 + share))))
    shown = picture(gpu, box, PLAIN.replace(layer="error", exposure=7, false_colour="luminance"), reference=reference)
    place = np.log(np.clip(100 * share, ERRORS.low, ERRORS.high) / ERRORS.low) / np.log(ERRORS.high / ERRORS.low)
    # the legend is sampled in steps of 1/1000 here, less than half a step of 8 bits
    expected = colour_map(1001)[round(place * 1000)]
    assert shown[SIZE[1] // 3, SIZE[0] // 2] / 255 == pytest.approx(expected, abs=STEP + 0.5 / 255)
    texels.release()


def test_where_the_reference_is_dark_errors_are_over_what_counts_as_dark(gpu: Gpu, box: Lightmap) -> None:
    texels, reference = reference_of(gpu, box, even(box, (0.0, 0.0, 0.0)))
    put(box, "t_irradiance", even(box, (0.2, 0.0, 0.0)))
    shown = picture(gpu, box, PLAIN.replace(layer="error"), reference=reference._replace(dark=2.0))  # 10 %
    expected = colour_map(1001)[round(1000 * np.log(10.0 / ERRORS.low) / np.log(ERRORS.high / ERRORS.low))]
    assert shown[SIZE[1] // 3, SIZE[0] // 2] / 255 == pytest.approx(expected, abs=STEP + 0.5 / 255)
    texels.release()


def test_a_split_picture_is_half_of_each(gpu: Gpu, box: Lightmap) -> None:
    texels, reference = reference_of(gpu, box, even(box, (0.5, 1.0, 2.0)))
    put(box, "t_irradiance", smooth(box))
    alone = picture(gpu, box)
    solution, other, split = (
        picture(gpu, box, PLAIN.replace(show=show, split=0.25), reference=reference)
        for show in ("solution", "reference", "split")
    )
    middle = SIZE[0] // 4
    assert (solution == alone).all() and (other != alone).any()
    assert (split[:, :middle] == alone[:, :middle]).all()
    assert (split[:, middle:] == other[:, middle:]).all()
    put(box, "t_irradiance", even(box, (0.5, 1.0, 2.0)))
    assert np.abs(picture(gpu, box).astype(int) - other).max() <= 1  # the reference looks as its light does
    texels.release()


def test_light_not_yet_shot_is_not_the_reference_s(gpu: Gpu, box: Lightmap) -> None:
    texels, reference = reference_of(gpu, box, even(box, (0.5, 1.0, 2.0)))
    put(box, "t_irradiance", even(box, (1.0, 1.0, 1.0)))
    display, made = PLAIN.replace(show="split", split=0.5), []
    for a in (0.0, 1.0):
        put_ambient(box, (a, a, a))
        made.append(picture(gpu, box, display, reference=reference))
    without, added = made
    middle = SIZE[0] // 2
    assert (added[:, :middle] != without[:, :middle]).any()
    assert (added[:, middle:] == without[:, middle:]).all()
    texels.release()


def test_layers_without_received_light_have_no_other_side(gpu: Gpu, box: Lightmap) -> None:
    texels, reference = reference_of(gpu, box, even(box, (1.0, 1.0, 1.0)))
    offered = {"residual": box.texture("t_residual"), "direct": box.texture("t_irradiance")}
    for layer in ("albedo", "residual", "charts", "direct", "indirect"):
        display = PLAIN.replace(layer=layer)
        both = picture(gpu, box, display.replace(show="reference"), reference=reference, offered=offered)
        assert (both == picture(gpu, box, display, offered=offered)).all()
    texels.release()
