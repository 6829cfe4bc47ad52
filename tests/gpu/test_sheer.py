"""Pictures of what is not opaque, and what is picked through it."""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np
import pytest
from numpy.typing import ArrayLike, NDArray
from solver_scenes import UNIT_SQUARE, begin, quads_scene, with_uv

from app.atlas.parametrize import parametrize
from app.gpu import Gpu
from app.lightmap.lightmap import Lightmap
from app.render.camera import CameraView
from app.render.frame import FrameRenderer
from app.render.options import DisplayOptions
from app.render.tone_mapping import encode_srgb
from app.scene.model import F64, Material, Scene, Texture

SIZE = (80, 60)
ALBEDO = DisplayOptions(layer="albedo", interpolation="nearest", tone_map="clamp")
# two 8-bit roundings of colours that are blended, and one of the picture
STEP = 2.01 / 255
CHECKER = Texture("checker", np.array([[[1], [0]], [[0], [1]]], np.float32), bilinear=False)
WALL, RED, GREEN, BLUE = (0.8, 0.8, 0.8), (0.7, 0.1, 0.1), (0.1, 0.6, 0.1), (0.1, 0.1, 0.7)


def sheets(*materials: Material) -> Scene:
    """Unit squares that face +z, one before the other: z = 0, 1/4, 1/2 ..."""
    quads = [UNIT_SQUARE + np.array([0, 0, z / 4]) for z in range(len(materials))]
    return with_uv(quads_scene(quads, materials, range(len(materials))))


class Shown:
    """A scene seen from (1/2, 1/2, 3) along -z."""

    def __init__(self, gpu: Gpu, scene: Scene) -> None:
        self._gpu, self._renderer = gpu, FrameRenderer(gpu)
        self.lightmap = Lightmap.of(gpu, scene, parametrize(scene, texels=4000))
        eye = np.eye(4)
        eye[:3, 3] = 0.5, 0.5, 3.0
        self._view = CameraView(eye, np.radians(40.0), 3.0)
        target = gpu.target(gpu.texture(SIZE, 4, "f1"))
        self._renderer.render(target, SIZE, self.lightmap, self._view, ALBEDO)
        read = np.frombuffer(target.read(components=3), np.uint8)
        self.picture: NDArray[np.float64] = read.reshape(SIZE[1], SIZE[0], 3)[::-1] / 255
        gpu.release_all(target)

    def px(self, place: ArrayLike) -> tuple[int, int]:
        """Column and row of a place."""
        clip = self._view.clip_from_local(SIZE[0] / SIZE[1], self.lightmap.space)
        x, y, _, w = clip @ [*self.lightmap.space.local_from_world(np.asarray(place, np.float64)), 1.0]
        return int((x / w + 1) / 2 * SIZE[0]), int((1 - y / w) / 2 * SIZE[1])

    def at(self, place: ArrayLike) -> F64:
        x, y = self.px(place)
        return self.picture[y, x]

    def picked(self, place: ArrayLike) -> int:
        """The object that a click there finds."""
        hit = self._renderer.pick(*self.px(place))
        assert hit is not None
        return int(self.lightmap.scene.object_ids[hit.triangle])

    def release(self) -> None:
        self._renderer.release()
        self.lightmap.release()


@contextmanager
def shown(gpu: Gpu, *materials: Material) -> Iterator[Shown]:
    made = Shown(gpu, sheets(*materials))
    yield made
    made.release()


def painted(colour: tuple[float, float, float], **opacity: object) -> Material:
    return Material("paint", colour, double_sided=True, **opacity)  # type: ignore[arg-type]


def test_what_is_cut_out_shows_what_lies_behind_and_is_picked_through(gpu: Gpu) -> None:
    board = painted(GREEN, opacity_texture=CHECKER, opacity_cutoff=0.5)
    with shown(gpu, painted(WALL), board) as made:
        for x, y in itertools.product((0.2, 0.4, 0.6, 0.8), repeat=2):
            there = (x < 0.5) == (y < 0.5)
            assert made.at((x, y, 0.25)) == pytest.approx(encode_srgb(np.array(GREEN if there else WALL)), abs=STEP)
            assert made.picked((x, y, 0.25)) == int(there)


def test_blended_sheets_lie_over_each_other_from_far_to_near(gpu: Gpu) -> None:
    """Whichever comes first in the file: here the nearer ones do. A click finds the nearest."""
    sheet = {"opacity": 0.25}
    wall, red, blue = (encode_srgb(np.array(c)) for c in (WALL, RED, BLUE))
    seen = 0.25 * red + 0.75 * (0.25 * blue + 0.75 * wall)
    scene = sheets(painted(WALL), painted(BLUE, **sheet), painted(RED, **sheet))
    turned = quads_scene(scene.corners.reshape(3, 6, 3)[::-1, [0, 1, 2, 5]], scene.materials[::-1], range(3))
    for one, nearest in ((scene, 2), (turned, 0)):
        made = Shown(gpu, one)
        assert made.at((0.3, 0.6, 0.5)) == pytest.approx(seen, abs=STEP)
        assert made.picked((0.3, 0.6, 0.5)) == nearest
        made.release()


def test_blended_sheets_that_cross_hide_nothing_of_each_other(gpu: Gpu) -> None:
    """Whichever is drawn first, behind it or before it the other one is seen too."""
    back = np.array([0, 0, 0.1])
    cross = np.array([[0, 0, 1], [1, 0, 0], [1, 1, 0], [0, 1, 1.0]])
    quads = [UNIT_SQUARE, cross + back, cross * np.array([-1, 1, 1]) + back + np.array([1, 0, 0])]
    sheets = [painted(WALL), painted(RED, opacity=0.5), painted(BLUE, opacity=0.5)]
    made = Shown(gpu, quads_scene(quads, sheets, range(3)))
    wall, red, blue = (encode_srgb(np.array(c)) for c in (WALL, RED, BLUE))
    both = [0.5 * near + 0.25 * far + 0.25 * wall for near, far in ((red, blue), (blue, red))]
    for x, y in itertools.product((0.1, 0.3, 0.7, 0.9), (0.2, 0.6)):
        assert any(made.at((x, y, 0.5)) == pytest.approx(colour, abs=STEP) for colour in both)
    made.release()


def test_a_blended_sheet_lies_over_the_background(gpu: Gpu) -> None:
    with shown(gpu, painted(WALL, opacity=0.5)) as made, shown(gpu, painted(WALL)) as whole:
        x, y = made.px((0.5, 0.5, 0.0))
        behind = whole.picture[y, 0]  # beside the sheet: a background alike along each row
        assert made.picture[y, x] == pytest.approx(0.5 * encode_srgb(np.array(WALL)) + 0.5 * behind, abs=STEP)


@pytest.mark.parametrize("solver", ["shooting", "gathering"])
def test_a_scene_of_nothing_opaque_is_lit(gpu: Gpu, solver: str) -> None:
    """What a sheet receives from a lamp before it that is half there: half of what it would."""
    power = []
    for opacity in (1.0, 0.5):
        lamp = Material("lamp", (0.0,) * 3, (1.0,) * 3, double_sided=True, opacity=opacity)
        solution = begin(gpu, sheets(painted(WALL, opacity=0.9), lamp), density=16, solver=solver)
        solution.settle()
        power.append(float((solution.area * solution.H[:, 0])[solution.object == 0].sum()))
        solution.release()
    assert power[1] == pytest.approx(power[0] / 2, rel=0.03)
