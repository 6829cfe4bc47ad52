"""The picture: what is shown of known light, where, in which colour, and what lies under a pixel."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from pictures import framing, ray, render_image, tone_map

import app.render.resolve
from app.atlas.lightmap import Lightmap
from app.atlas.parametrize import parametrize
from app.gpu import Gpu
from app.render.camera import CameraView
from app.render.develop import encode_srgb
from app.render.exposure import exposure_of
from app.render.false_colour import LUMINANCE, colour_map, false_colour_scale
from app.render.frame import FrameRenderer
from app.render.options import INTERPOLATIONS, LAYERS, TONE_MAPS, DisplayOptions
from app.scene.load import load_scene
from app.scene.model import F64, Material, Scene

SIZE = (160, 120)
PLAIN = DisplayOptions(tone_map="clamp")
# One step of the 8 bits that display texels and picture are both rounded to, half a step each
STEP = 1.01 / 255


@pytest.fixture(scope="module")
def cornell() -> Scene:
    return load_scene("cornell-box")


@pytest.fixture
def box(gpu: Gpu, cornell: Scene) -> Iterator[Lightmap]:
    lightmap = Lightmap.of(gpu, cornell, parametrize(cornell, texels=4000))
    yield lightmap
    lightmap.release()


def view_of(lightmap: Lightmap) -> CameraView:
    camera = lightmap.scene.cameras[0]
    distance = float(np.linalg.norm(camera.world_from_camera[:3, 3] - lightmap.frame.centre))
    return CameraView.from_camera(camera, distance)


def put(lightmap: Lightmap, name: str, tiles: F64) -> None:
    """Light (tiles, 16, 16, 3) [W/m²] into ``t_irradiance`` or ``t_residual``."""
    image = lightmap.nodes.image_from_tiles(np.concatenate([tiles / lightmap.unit, tiles[..., :1] * 0], -1))
    lightmap.texture(name).write(np.ascontiguousarray(image, np.float32).tobytes())


def even(lightmap: Lightmap, H: tuple[float, float, float]) -> F64:
    """The same light on every texel that covers a surface, none on the others."""
    return (lightmap.nodes.surfaces.area > 0)[..., None] * np.array(H)


def picture(gpu: Gpu, lightmap: Lightmap, display: DisplayOptions = PLAIN, **more: object) -> NDArray[np.uint8]:
    view = more.pop("view", None) or view_of(lightmap)
    return render_image(gpu, lightmap, view, display, SIZE, **more)


def hits(scene: Scene, view: CameraView, pixels: NDArray[np.intp]) -> tuple[NDArray[np.intp], F64]:
    """Nearest triangle (-1: none) and position (n, 3) [m] behind pixel centres (n, 2), in float64 [Moller97]."""
    a, b, c = np.moveaxis(scene.corners, 1, 0)
    triangles, positions = [], []
    for x, y in pixels:
        ndc = (np.array([x, y]) + 0.5) / SIZE * 2 - 1
        origin, direction = ray(view, ndc[0], -ndc[1], SIZE[0] / SIZE[1])
        normal = np.cross(b - a, c - a)
        det = -normal @ direction
        from_a = origin - a
        along = np.cross(from_a, direction)
        with np.errstate(divide="ignore", invalid="ignore"):
            u = np.einsum("ij,ij->i", c - a, along) / det
            v = -np.einsum("ij,ij->i", b - a, along) / det
            t = np.einsum("ij,ij->i", from_a, normal) / det
        t[~((u >= 0) & (v >= 0) & (u + v <= 1) & (t > 0))] = np.inf
        nearest = int(t.argmin())
        triangles.append(nearest if np.isfinite(t[nearest]) else -1)
        positions.append(origin + direction * (t[nearest] if np.isfinite(t[nearest]) else 0.0))
    return np.array(triangles), np.array(positions)


def looking_at(eye: F64, target: F64) -> CameraView:
    """A view of the 20 cm around a target, with a level horizon."""
    back = (eye - target) / np.linalg.norm(eye - target)
    right = np.cross([0.0, 1.0, 0.0], back)
    right /= np.linalg.norm(right)
    world_from_camera = np.eye(4)
    world_from_camera[:3] = np.stack([right, np.cross(back, right), back, eye], axis=1)
    distance = float(np.linalg.norm(eye - target))
    return CameraView(world_from_camera, 2 * float(np.arctan(0.1 / distance)), distance)


def some_pixels(rng: np.random.Generator, count: int) -> NDArray[np.intp]:
    return np.stack([rng.integers(0, SIZE[0], count), rng.integers(0, SIZE[1], count)], -1)


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
    renderer.render(target, SIZE, box, view_of(box), display)
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
    position = box.frame.local_from_world(box.nodes.surfaces.position)
    put(box, "t_irradiance", even(box, (1, 1, 1)) * (1.5 + position[..., :1]))
    pixels = some_pixels(rng, 400)
    triangle, world = hits(box.scene, view_of(box), pixels)
    names = np.array([box.scene.objects[i] for i in box.scene.object_ids])
    inside = (names[triangle] == "back wall") & (np.abs(box.frame.local_from_world(world)[:, :2]) < 0.5).all(1)
    assert inside.sum() > 30
    expected = encode_srgb((1.5 + box.frame.local_from_world(world)[inside, 0]) / np.pi) * 255
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
    nodes, compared, crossing = box.nodes, 0, 0
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
            slots.add(slot := nodes.slot_at((float(u), float(v))))
            covered = slot >= 0 and nodes.surfaces.area[slot, v % 16, u % 16] > 0
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


def test_ambient_light_is_added_for_display_only(gpu: Gpu, box: Lightmap) -> None:
    put(box, "t_irradiance", even(box, (2.0, 3.0, 4.0)))
    lit = picture(gpu, box)
    put(box, "t_irradiance", even(box, (0.0, 0.0, 0.0)))
    ambient = (2.0, 3.0, 4.0)
    assert (picture(gpu, box, PLAIN.replace(ambient=True), ambient=ambient) == lit).all()
    assert (picture(gpu, box, PLAIN, ambient=ambient) != lit).any()


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


# -- depth -------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("eye", [(0.278, 0.3, 0.1), (0.278, 0.273, -0.8), (0.278, 0.2, -3.0), (0.5, 0.5, 0.4)])
def test_the_lamp_does_not_flicker_through_its_ceiling(
    gpu: Gpu, box: Lightmap, rng: np.random.Generator, eye: tuple[float, float, float]
) -> None:
    """0.1 mm between them: every pixel whose ray meets the lamp first shows it, none else."""
    lamp_centre = np.array([0.278, 0.5487, 0.2795])
    view = looking_at(np.array(eye), lamp_centre)
    image = picture(gpu, box, PLAIN.replace(layer="residual"), view=view)
    bright = (image > 250).all(-1)
    pixels = some_pixels(rng, 1500)
    triangle, _ = hits(box.scene, view, pixels)
    lamp = (triangle >= 0) & (box.scene.material_ids[triangle] == [m.name for m in box.scene.materials].index("light"))
    assert 40 < lamp.sum() < 1460
    # rays that graze the lamp's edge: the rasteriser snaps corners to 1/256 pixel
    assert (bright[pixels[:, 1], pixels[:, 0]] != lamp).mean() < 0.01


def test_walls_nearer_than_the_near_plane_are_drawn(gpu: Gpu, box: Lightmap) -> None:
    put(box, "t_irradiance", even(box, (1.0, 1.0, 1.0)))
    view = view_of(box)
    back_wall = 0.5592  # z of the back wall [m]; the view looks along +z
    view.world_from_camera[:3, 3] = (0.278, 0.273, back_wall - 1e-5)
    image = picture(gpu, box, PLAIN.replace(layer="irradiance"), view=view)
    assert (np.abs(image.astype(int) - int(encode_srgb(np.array(1 / np.pi)) * 255)) <= 1).all()


# -- picking -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("samples", [1, 2])
def test_pick_agrees_with_a_ray(gpu: Gpu, box: Lightmap, rng: np.random.Generator, samples: int) -> None:
    renderer = FrameRenderer(gpu)
    target = gpu.target(gpu.texture(SIZE, 4, "f1"))
    assert renderer.pick(1, 1) is None, "nothing has been drawn yet"
    renderer.render(target, SIZE, box, view_of(box), PLAIN, samples=samples)
    pixels = some_pixels(rng, 50)
    triangle, world = hits(box.scene, view_of(box), pixels)
    for (x, y), expected, position in zip(pixels, triangle, world, strict=True):
        hit = renderer.pick(x, y)
        assert (-1 if hit is None else hit.triangle) == expected
        if hit is None or hit.texel is None:
            continue
        # single precision on a scene of radius 1
        assert np.array(hit.position) == pytest.approx(position, abs=1e-5 * box.frame.scale)
        assert hit.material == box.scene.material_ids[expected]
        assert hit.tile is not None
        assert hit.tile_texel is not None
        column, row = hit.tile_texel
        texel = box.nodes.surfaces.position[hit.tile, row, column]
        # a texel's centroid and a point of it: within its diagonal, twice as long where it is cut or stretched
        assert np.linalg.norm(texel - position) < 2 * np.sqrt(2) / box.charts.density
    assert (triangle >= 0).any()
    assert (triangle < 0).any()
    renderer.release()
    gpu.release_all(target)


# -- overlays ----------------------------------------------------------------------------------------------------------


def test_the_shooter_is_marked_where_it_is(gpu: Gpu, box: Lightmap, rng: np.random.Generator) -> None:
    put(box, "t_irradiance", even(box, (1.0, 1.0, 1.0)))
    renderer = FrameRenderer(gpu)
    target = gpu.target(gpu.texture(SIZE, 4, "f1"))
    renderer.render(target, SIZE, box, view_of(box), PLAIN)
    plain = picture(gpu, box)
    hit = renderer.pick(SIZE[0] // 2, SIZE[1] // 2)
    assert hit is not None
    assert hit.atlas_uv is not None
    u, v = np.floor(np.array(hit.atlas_uv) / 8) * 8
    rect = (float(u), float(v), float(u) + 8, float(v) + 8)
    assert (picture(gpu, box, PLAIN, shooter=rect) == plain).all(), "off by default"
    changed = np.argwhere((picture(gpu, box, PLAIN.replace(last_shooter=True), shooter=rect) != plain).any(-1))
    assert len(changed) > 30
    for y, x in rng.permutation(changed)[:20]:
        under = renderer.pick(x, y)
        assert under is not None
        assert under.atlas_uv is not None
        # the outline reaches up to two pixels outside, here less than two texels
        assert rect[0] - 2 <= under.atlas_uv[0] <= rect[2] + 2
        assert rect[1] - 2 <= under.atlas_uv[1] <= rect[3] + 2
    renderer.release()
    gpu.release_all(target)


@pytest.mark.parametrize("display", [PLAIN.replace(grid=True), PLAIN.replace(layer="charts")])
def test_lines_and_squares_are_there_and_do_not_hide_the_picture(
    gpu: Gpu, box: Lightmap, display: DisplayOptions
) -> None:
    put(box, "t_irradiance", even(box, (1.0, 1.0, 1.0)))
    view = view_of(box)
    view.dolly(0.4)
    plain = picture(gpu, box, display.replace(grid=False, layer="irradiance"), view=view).astype(int)
    image = picture(gpu, box, display, view=view).astype(int)
    assert 0.02 < (np.abs(image - plain).max(-1) > 8).mean()
    assert len(np.unique(image.reshape(-1, 3), axis=0)) > 10
    assert image.mean() > 60


# -- false colour and exposure -----------------------------------------------------------------------------------------


@pytest.mark.parametrize("logarithmic", [False, True])
@pytest.mark.parametrize("share", [0.0, 0.1, 0.5, 1.0])
def test_false_colour_is_the_colour_of_the_value(gpu: Gpu, box: Lightmap, logarithmic: bool, share: float) -> None:
    """A share of the top of the scale has the colour of the legend there, whatever the exposure."""
    high = 500.0
    put(box, "t_irradiance", even(box, (1, 1, 1)) * (share * high / 179.0))
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


def mean_residual(lightmap: Lightmap) -> np.ndarray:
    """r̄ over all texels, RGB [W/m²]."""
    area = lightmap.nodes.surfaces.area
    return np.einsum("tijc,tij->c", lightmap.residual().astype(np.float64), area) / area.sum()


def test_a_logarithmic_scale_spans_what_is_lit(box: Lightmap) -> None:
    """From what is nearly the darkest to nearly the brightest of what does not emit, however bright a lamp is."""
    rng = np.random.default_rng(7)
    lux = 10 ** rng.uniform(1, 3, box.nodes.surfaces.area.shape)
    emits = np.array([m.emits for m in box.scene.materials])
    face = box.nodes.surfaces.face
    lamp = emits[box.scene.material_ids[box.charts.face_triangle[face]]] & (face >= 0)
    assert lamp.any()
    lux[lamp] = 1e6
    put(box, "t_irradiance", np.repeat((lux / 179)[..., None], 3, -1))
    low, high, _ = false_colour_scale(DisplayOptions(false_colour="illuminance"), box)
    assert 8 <= low <= 12 and 900 <= high <= 1200  # 1 % and 99 % of two decades, rounded outwards to short numbers


def test_scale_and_exposure_come_from_the_light(box: Lightmap) -> None:
    H = (1.0, 2.0, 0.5)
    put(box, "t_irradiance", even(box, H))
    put(box, "t_residual", even(box, (0.0, 0.0, 0.0)))
    lux = 179 * np.array(H) @ LUMINANCE
    scale = false_colour_scale(DisplayOptions(false_colour="illuminance", false_colour_log=False), box)
    assert lux <= scale.high <= 1.5 * lux
    luminance = false_colour_scale(DisplayOptions(false_colour="luminance", false_colour_log=False), box)
    brightest = max(np.array(m.albedo) * H @ LUMINANCE for m in box.scene.materials if not m.emits)
    assert 179 / np.pi * brightest <= luminance.high <= 1.5 * 179 / np.pi * brightest
    assert luminance.unit == "cd/m²"

    exposure = exposure_of(box, mean_residual(box))
    area = box.nodes.surfaces.area
    mean = np.average(np.log((box.albedo() * H @ LUMINANCE)[area > 0] / np.pi), weights=area[area > 0])
    assert 2.0**exposure * np.exp(mean) == pytest.approx(0.18, rel=1e-5)
    put(box, "t_irradiance", even(box, H) * 8)
    assert exposure_of(box, mean_residual(box)) == pytest.approx(exposure - 3, abs=1e-5)


def test_a_scene_just_opened_is_exposed_for_the_light_to_come(box: Lightmap) -> None:
    exposure = exposure_of(box, mean_residual(box))
    assert np.isfinite(exposure)
    assert abs(exposure) < 4, "the lamp of the Cornell box gives about as much light as the exposure of 0 is for"
    put(box, "t_residual", even(box, (0.0, 0.0, 0.0)))
    assert exposure_of(box, mean_residual(box)) == 0.0, "no light at all"


# -- frames ------------------------------------------------------------------------------------------------------------


def test_samples_average_to_the_same_picture_with_smooth_edges(gpu: Gpu, box: Lightmap) -> None:
    put(box, "t_irradiance", even(box, (1.0, 1.0, 1.0)))
    one, four = (picture(gpu, box, samples=samples).astype(int) for samples in (1, 2))
    assert len(np.unique(four.reshape(-1, 3), axis=0)) > len(np.unique(one.reshape(-1, 3), axis=0))
    same = (np.abs(one - four) <= 1).all(-1).mean()
    assert 0.9 < same < 1.0


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

    for display in (PLAIN, PLAIN.replace(exposure=1.0)):
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
