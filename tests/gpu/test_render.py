"""The picture: what is shown of known light, where, and in which colour."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from boxes import PLAIN, SIZE, STEP, box, cornell, even, hits, picture, put, put_ambient, some_pixels, view_of
from numpy.typing import NDArray
from pictures import framing, render_image, tone_map

import app.render.resolve
from app.atlas.parametrize import parametrize
from app.gpu import Gpu
from app.lightmap.lightmap import Lightmap
from app.render.frame import FrameRenderer
from app.render.options import INTERPOLATIONS, LAYERS, TONE_MAPS, DisplayOptions
from app.render.resolve import Reference
from app.render.tone_mapping import encode_srgb
from app.scene.model import F64, Material, Scene

__all__ = ["box", "cornell"]


def decode_srgb(encoded: F64) -> F64:
    """sRGB [0, 1] to linear, IEC 61966-2-1 by hand."""
    return np.where(encoded <= 0.04045, encoded / 12.92, ((encoded + 0.055) / 1.055) ** 2.4)


# -- colours -----------------------------------------------------------------------------------------------------------


def radiance(lightmap: Lightmap, layer: str, tile: int, row: int, column: int) -> F64:
    """What a layer shows of a texel, by its definition."""
    at = tile, row, column
    return {
        "combined": lightmap.radiosity()[at] / np.pi,
        "irradiance": lightmap.irradiance()[at] / np.pi,
        "residual": lightmap.residual()[at] / np.pi,
        "albedo": lightmap.albedo()[at],
    }[layer]


@pytest.mark.parametrize(
    ("layer", "tone"), [("combined", tone) for tone in TONE_MAPS] + [(name, "agx") for name in LAYERS[1:4]]
)
def test_pixels_show_their_texel(gpu: Gpu, box: Lightmap, rng: np.random.Generator, layer: str, tone: str) -> None:
    """Random light over six decades: pixels equal the numpy twin of the layer and of the tone curve."""
    for name in ("t_irradiance", "t_residual"):
        put(box, name, even(box, (1, 1, 1)) * 10 ** rng.uniform(-3, 3, (box.tiles, 16, 16, 3)))
    display = DisplayOptions(layer=layer, tone_map=tone, interpolation="nearest", exposure=-1.5)
    renderer = FrameRenderer(gpu)
    target = gpu.target(gpu.texture(SIZE, 4, "f1"))
    renderer.render(target, SIZE, box, view_of(box), display, offered={"residual": box.texture("t_residual")})
    shown = np.frombuffer(target.read(components=3), np.uint8).reshape(SIZE[1], SIZE[0], 3)[::-1] / 255
    compared = 0
    for x, y in some_pixels(rng, 60):
        hit = renderer.pick(x, y)
        if hit is None or hit.tile is None or hit.tile_texel is None:
            continue
        column, row = hit.tile_texel
        value = radiance(box, layer, hit.tile, row, column).astype(np.float64)
        expected = value if layer == "albedo" else tone_map(tone, value * 2.0**display.exposure)
        assert shown[y, x] == pytest.approx(encode_srgb(expected), abs=STEP)
        compared += 1
    assert compared > 20
    renderer.release()
    gpu.release_all(target)


@pytest.mark.parametrize("interpolation", INTERPOLATIONS)
def test_even_light_has_no_fringes(gpu: Gpu, box: Lightmap, interpolation: str) -> None:
    """Neither gutters nor tile borders nor chart edges show: every surface has the one colour."""
    put(box, "t_irradiance", even(box, (1.0, 1.5, 2.0)))
    display = PLAIN.replace(layer="irradiance", interpolation=interpolation)
    image = picture(gpu, box, display).reshape(-1, 3)
    surface = np.ptp(image.astype(int), axis=1) > 20  # the background is grey
    expected = encode_srgb(np.array([1.0, 1.5, 2.0]) / np.pi) * 255
    assert surface.sum() > 5000
    assert np.abs(image[surface] - expected).max() <= 1.01


def test_smooth_texels_follow_a_ramp_across_tiles(gpu: Gpu, box: Lightmap, rng: np.random.Generator) -> None:
    """Bilinear and bicubic texels reproduce light that is linear along the wall; nearest ones cannot."""
    position = box.space.local_from_world(box.pool.surfaces.position)
    put(box, "t_irradiance", even(box, (1, 1, 1)) * (1.5 + position[..., :1]))
    pixels = some_pixels(rng, 400)
    triangle, world = hits(box.scene, view_of(box), pixels)
    names = np.array([box.scene.objects[i] for i in box.scene.object_ids])
    inside = (names[triangle] == "back wall") & (np.abs(box.space.local_from_world(world)[:, :2]) < 0.5).all(1)
    assert inside.sum() > 30
    expected = encode_srgb((1.5 + box.space.local_from_world(world)[inside, 0]) / np.pi) * 255
    errors = {}
    for interpolation in INTERPOLATIONS:
        image = picture(gpu, box, PLAIN.replace(layer="irradiance", interpolation=interpolation))
        errors[interpolation] = np.abs(image[pixels[inside, 1], pixels[inside, 0], 0] - expected).max()
    # two roundings to 8 bits, and the bend of the sRGB curve between two texels, 1/8 of its second difference
    assert errors["bilinear"] < 1.5
    assert errors["bicubic"] < 1.5
    assert errors["nearest"] > 2 * errors["bilinear"]


def test_bicubic_is_the_cubic_b_spline(gpu: Gpu, box: Lightmap, rng: np.random.Generator) -> None:
    """Random texels on the back wall, across its tiles: pixels are the tensor product of the spline's weights in float64."""
    put(box, "t_irradiance", even(box, (1, 1, 1)) * rng.uniform(0, 2.0, (box.tiles, 16, 16, 1)))
    display = PLAIN.replace(layer="irradiance", interpolation="bicubic")
    renderer = FrameRenderer(gpu)
    target = gpu.target(gpu.texture(SIZE, 4, "f1"))
    renderer.render(target, SIZE, box, view_of(box), display)
    image = np.frombuffer(target.read(components=3), np.uint8).reshape(SIZE[1], SIZE[0], 3)[::-1, :, 0]
    texels = encode_srgb(box.irradiance()[..., 0] / np.pi)
    pool, compared, crossing = box.pool, 0, 0
    for x, y in some_pixels(rng, 300):
        hit = renderer.pick(x, y)
        if hit is None or hit.atlas_uv is None or box.scene.objects[box.scene.object_ids[hit.triangle]] != "back wall":
            continue
        base = np.floor(np.array(hit.atlas_uv) - 0.5).astype(int)
        t = np.array(hit.atlas_uv) - 0.5 - base
        s = 1 - t
        weights = np.array([s**3, 3 * t**3 - 6 * t**2 + 4, 3 * s**3 - 6 * s**2 + 4, t**3]) / 6
        value, slots = 0.0, set()
        for j, i in np.ndindex(4, 4):
            u, v = int(base[0]) + i - 1, int(base[1]) + j - 1
            slots.add(slot := pool.slot_at((float(u), float(v))))
            covered = slot >= 0 and pool.surfaces.area[slot, v % 16, u % 16] > 0
            value += weights[i, 0] * weights[j, 1] * (texels[slot, v % 16, u % 16] if covered else np.nan)
        if np.isfinite(value):
            # the sampler's weights have 8 bits, for texels of the whole range, and its answers too
            assert image[y, x] / 255 == pytest.approx(value, abs=3 * STEP)
            compared, crossing = compared + 1, crossing + (len(slots) > 1)
    assert compared > 30
    assert crossing > 5
    renderer.release()
    gpu.release_all(target)


def test_right_way_up_and_round(gpu: Gpu, box: Lightmap) -> None:
    """The lamp is above, the red wall left, the green one right."""
    put(box, "t_irradiance", even(box, (1.0, 1.0, 1.0)))
    image = picture(gpu, box).astype(int)
    height, width, _ = image.shape
    lamp = np.argwhere((image == 255).all(-1))
    assert len(lamp) > 20
    assert lamp[:, 0].max() < height / 3
    left, right = image[height // 2, int(width * 0.2)], image[height // 2, int(width * 0.8)]
    assert left[0] > 2 * left[1]
    assert right[1] > 2 * right[2]


@pytest.mark.parametrize("layer", ["combined", "irradiance"])
def test_what_is_still_to_come_is_shown_with_what_has_arrived(gpu: Gpu, box: Lightmap, layer: str) -> None:
    """Also where light was taken away."""
    display = PLAIN.replace(layer=layer)
    put(box, "t_irradiance", even(box, (4.0, 2.0, 1.5)))
    lit = picture(gpu, box, display)
    put(box, "t_irradiance", even(box, (2.0, 1.5, 2.0)))
    assert (picture(gpu, box, display) != lit).any()
    put_ambient(box, (2.0, 0.5, -0.5))
    assert (picture(gpu, box, display) == lit).all()
    H, covered = box.irradiance(ambient=True), box.pool.surfaces.area > 0
    np.testing.assert_allclose(H[covered], np.broadcast_to((4.0, 2.0, 1.5), H[covered].shape), rtol=1e-6)
    np.testing.assert_allclose(box.irradiance()[covered][:, 0], 2.0, rtol=1e-6)
    box.hold_ambient()  # of each texel its own
    assert (picture(gpu, box, display) != lit).any()
    put(box, "t_ambient", even(box, (2.0, 0.5, -0.5)))
    assert (picture(gpu, box, display) == lit).all()
    np.testing.assert_allclose(box.irradiance(ambient=True)[covered], H[covered])


# -- sides without texels ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("layer", ["combined", "albedo"])
@pytest.mark.parametrize("double_sided", [False, True])
def test_sides_without_texels_show_what_they_are(gpu: Gpu, layer: str, double_sided: bool) -> None:
    """Nothing lies before the square: no texels in front, yet its E and ρ are seen. Its back is black if one-sided."""
    rgb = (0.5, 0.25, 0.125)
    square = Material("square", albedo=rgb, emission=rgb, double_sided=double_sided)
    corners = np.array([(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)], np.float64)
    positions = np.concatenate(
        [corners, corners + np.array([6.0, 0.0, -3.0])]
    )  # the other one stands aside and further back
    triangles = np.array([(0, 1, 2), (0, 2, 3), (4, 5, 6), (4, 6, 7)], np.int32)
    ids = np.array([0, 0, 1, 1], np.int32)
    scene = Scene("squares", positions, triangles, ids, ids, ("square", "other"), (square, Material("other")))
    lightmap = Lightmap.of(gpu, scene, parametrize(scene, texels=64))
    view = framing(corners.min(0), corners.max(0))
    behind = view.copy()
    behind.orbit(np.pi, 0.0)
    renderer = FrameRenderer(gpu)
    colour = gpu.texture(SIZE, 4, "f1")
    target = gpu.target(colour)
    for stand, back in ((view, False), (behind, True)):
        renderer.render(target, SIZE, lightmap, stand, PLAIN.replace(layer=layer))
        shown = (
            np.frombuffer(colour.read(), np.uint8).reshape(SIZE[1], SIZE[0], 4)[SIZE[1] // 2, SIZE[0] // 2, :3] / 255
        )
        seen = np.array(rgb) if double_sided or not back else np.zeros(3)
        assert shown == pytest.approx(encode_srgb(seen), abs=STEP)
        hit = renderer.pick(SIZE[0] / 2, SIZE[1] / 2)
        assert hit is not None
        assert hit.back == back
        assert (hit.texel is not None) == (back and double_sided)
    renderer.release()
    gpu.release_all(target, colour)
    lightmap.release()


# -- frames ------------------------------------------------------------------------------------------------------------


def test_samples_average_to_the_same_picture_with_smooth_edges(gpu: Gpu, box: Lightmap) -> None:
    put(box, "t_irradiance", even(box, (1.0, 1.0, 1.0)))
    one, many = (picture(gpu, box, samples=samples).astype(int) for samples in (1, 16))
    assert len(np.unique(many.reshape(-1, 3), axis=0)) > len(np.unique(one.reshape(-1, 3), axis=0))
    same = (np.abs(one - many) <= 1).all(-1).mean()
    assert 0.9 < same < 1.0


def test_an_edge_covers_its_share_of_a_pixel(gpu: Gpu, box: Lightmap) -> None:
    """Of pixels on the edge of the lamp in a picture of few pixels, against the same drawn 32 times as large: as the screen shows
    them, as light."""
    put(box, "t_irradiance", even(box, (0.0, 0.0, 0.0)))
    small, fine = (24, 18), 32
    large = render_image(gpu, box, view_of(box), PLAIN, (small[0] * fine, small[1] * fine)) / 255.0
    exact = decode_srgb(large).reshape(small[1], fine, small[0], fine, 3).mean((1, 3))
    off = {}
    for samples in (1, 16):
        shown = decode_srgb(render_image(gpu, box, view_of(box), PLAIN, small, samples=samples) / 255.0)
        off[samples] = float(np.sqrt(((shown - exact) ** 2).mean()))
    assert off[16] < 0.15 * off[1]


def test_samples_that_are_added_one_by_one_are_those_of_one_picture(gpu: Gpu, box: Lightmap) -> None:
    put(box, "t_irradiance", even(box, (1.0, 2.0, 3.0)))
    expected = picture(gpu, box, samples=5)
    renderer, colour = FrameRenderer(gpu), gpu.texture(SIZE, 4, "f1")
    target = gpu.target(colour)
    renderer.render(target, SIZE, box, view_of(box), PLAIN, whole=False)
    for nth in range(5):
        assert renderer.render(target, SIZE, box, view_of(box), PLAIN, add=True) and renderer.samples == nth + 1
    shown = np.frombuffer(colour.read(), np.uint8).reshape(SIZE[1], SIZE[0], 4)[::-1, :, :3]
    assert (shown == expected).all()
    renderer.render(target, SIZE, box, view_of(box), PLAIN)
    assert renderer.samples == 0, "what moves begins anew"
    renderer.release()
    gpu.release_all(target, colour)


def test_any_target_gets_the_same_picture(gpu: Gpu, box: Lightmap) -> None:
    """A texture of the right size is drawn into directly, a renderbuffer or a larger target through a copy."""
    put(box, "t_irradiance", even(box, (1.0, 2.0, 3.0)))
    expected = picture(gpu, box)
    renderer = FrameRenderer(gpu)
    larger = gpu.texture((SIZE[0] + 10, SIZE[1] + 20), 4, "f1")
    for colour in (gpu.ctx.renderbuffer(SIZE, 4), larger):
        target = gpu.target(colour)
        renderer.render(target, SIZE, box, view_of(box), PLAIN)
        pixels = np.frombuffer(target.read((0, 0, *SIZE), 3), np.uint8).reshape(SIZE[1], SIZE[0], 3)[::-1]
        assert (pixels == expected).all()
        gpu.release_all(target, colour)
    renderer.release()


def test_large_lightmaps_are_brought_up_to_date_in_turn(
    gpu: Gpu, box: Lightmap, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(app.render.resolve, "TEXELS_PER_FRAME", 1 << 11)
    put(box, "t_irradiance", even(box, (1.0, 1.0, 1.0)))
    renderer = FrameRenderer(gpu)
    colour = gpu.texture(SIZE, 4, "f1")
    target = gpu.target(colour)

    def frame(display: DisplayOptions, whole: bool = False) -> NDArray[np.uint8]:
        renderer.render(target, SIZE, box, view_of(box), display, whole=whole)
        return np.frombuffer(colour.read(), np.uint8).reshape(SIZE[1], SIZE[0], 4)[::-1, :, :3]

    monkeypatch.setattr(app.render.resolve, "SWITCHED_PER_FRAME", 1 << 11)
    frame(PLAIN, whole=True)
    display = PLAIN.replace(exposure=1.0)
    expected = picture(gpu, box, display)
    frames = [frame(display) for _ in range(box.size[0] * box.size[1] // (1 << 11) + 8)]
    differing = [int((f != expected).any(-1).sum()) for f in frames]
    assert differing[0] > differing[2] > 0
    assert differing[-1] == 0
    assert (frame(PLAIN, whole=True) == picture(gpu, box)).all()
    for interpolation in ("bicubic", "bilinear"):  # with other borders: nothing of them is there yet
        display = PLAIN.replace(interpolation=interpolation)
        assert (frame(display) == picture(gpu, box, display)).all()
    renderer.release()
    gpu.release_all(target, colour)


def test_a_frame_is_of_one_layer(gpu: Gpu, box: Lightmap, monkeypatch: pytest.MonkeyPatch) -> None:
    """Where a frame has time for a part of the texels only, the layer before stays until all of the next is there; so does what
    was before a reference."""
    for name in ("TEXELS_PER_FRAME", "SWITCHED_PER_FRAME"):
        monkeypatch.setattr(app.render.resolve, name, 1 << 11)
    put(box, "t_irradiance", even(box, (1.0, 1.0, 1.0)))
    other = gpu.texture(box.size, 4, "f4", np.full((*box.size[::-1], 4), 3.0, np.float32).tobytes())
    renderer, colour = FrameRenderer(gpu), gpu.texture(SIZE, 4, "f1")
    target = gpu.target(colour)

    def frame(display: DisplayOptions) -> tuple[bool, NDArray[np.uint8]]:
        of = Reference(other, 1.0)
        drawn = renderer.render(target, SIZE, box, view_of(box), display, reference=of, whole=False)
        return drawn, np.frombuffer(colour.read(), np.uint8).reshape(SIZE[1], SIZE[0], 4)[::-1, :, :3].copy()

    target.clear()
    shown = frame(PLAIN)[1]
    assert (shown == 0).all(), "not even the first begins in parts"
    asked = [PLAIN.replace(layer=layer) for layer in ("combined", "albedo", "charts", "irradiance", "combined")]
    others = PLAIN.replace(show="reference"), PLAIN.replace(show="split"), PLAIN
    for nth, display in enumerate((*asked, *others)):
        expected, kept = picture(gpu, box, display, reference=Reference(other, 1.0)), 0
        while not (seen := frame(display))[0]:
            assert (seen[1] == shown).all()
            kept += 1
        assert (seen[1] == expected).all()
        assert kept > 2 or nth >= len(asked), "it takes several frames"
        shown = expected
    renderer.release()
    gpu.release_all(target, colour, other)


def test_a_frame_follows_storage_and_materials(gpu: Gpu, box: Lightmap) -> None:
    renderer = FrameRenderer(gpu)
    colour = gpu.texture(SIZE, 4, "f1")
    target = gpu.target(colour)
    renderer.render(target, SIZE, box, view_of(box), PLAIN)
    box.set_storage("rgba16f")
    box.clear()
    dim = tuple(replace(m, emission=tuple(0.01 * e for e in m.emission)) for m in box.scene.materials)
    box.set_materials(dim)
    box.clear()
    renderer.render(target, SIZE, box, view_of(box), PLAIN)
    brightest = np.frombuffer(colour.read(), np.uint8).reshape(-1, 4)[:, :3].max(0) / 255
    assert brightest == pytest.approx(encode_srgb(np.array([0.17, 0.12, 0.04])), abs=0.15)
    assert brightest[0] == pytest.approx(encode_srgb(np.array(0.17)), abs=STEP)
    renderer.release()
    gpu.release_all(target, colour)
