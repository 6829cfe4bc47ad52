"""Lamps, many and small ones too, give all of their light to what is gathered, for no more rays."""

from __future__ import annotations

import itertools
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from solver_scenes import gathered, grey, quads_scene, room

from app.direct_light.lamps import ALONE, NearLamps
from app.direct_light.lit import PASS, folded
from app.gpu import Gpu
from app.lightmap.tile_pool import Moves
from app.scene.model import F32, Scene, Texture
from app.scene.shapes import box, merged
from app.solvers.gathering.solver import SOLVED
from app.util.parts import run_to_end
from app.validation.scenes import across, scene_of


def test_lamps_that_share_a_set_are_edited_while_rays_are_under_way(gpu: Gpu) -> None:
    """The set is another then, after the piece of work that goes through the old one."""
    scene = lamps_at_the_ceiling(16, 2 * ALONE)
    lit = gathered(gpu, scene, 32, density=2)
    materials = scene.materials
    shared = lit.rays.direct.sets[-1]
    dimmer = replace(materials[-1], emission=tuple(e / 2 for e in materials[-1].emission))
    under_way, before = lit.rays.work(16), shared.passes.sum()
    while shared.passes.sum() == before:
        next(under_way)
    lit.rays.set_materials((*materials[:-1], dimmer))
    run_to_end(under_way)
    assert lit.rays.direct.sets[-1] is shared
    lit.gather(64)
    assert np.isfinite(lit.H).all() and len(lit.rays.direct.sets) == ALONE + 1
    assert lit.rays.direct.sets[-1] is not shared
    lit.release()


def test_lamps_may_be_more_than_a_texture_has_rows(gpu: Gpu) -> None:
    """Their list is folded, in order."""
    n = 5 * gpu.limits.max_texture + 1
    values = np.arange(4 * n, dtype=np.float32).reshape(n, 4) % 1021
    texture = folded(gpu, values)
    width, height = texture.size
    assert width * height < n + width and height <= gpu.limits.max_texture
    np.testing.assert_array_equal(np.frombuffer(texture.read(), np.float32).reshape(-1, 4)[:n], values)
    gpu.release_all(texture)


def lamps_at_the_ceiling(count: int, materials: int) -> Scene:
    """A room 4 × 3 × 4 with so many lamps of 1 cm² below its ceiling, that emit 100 W in all, in so many materials."""
    side = int(np.ceil(np.sqrt(count)))
    at = [(4 * (i // side + 0.5) / side, 4 * (i % side + 0.5) / side) for i in range(count)]
    quads = [
        [(x - h, 2.75, z - h), (x + h, 2.75, z - h), (x + h, 2.75, z + h), (x - h, 2.75, z + h)]
        for x, z in at
        for h in (0.005,)
    ]
    paints = [replace(grey(0.0, 100.0 / count / 1e-4), name=f"lamp {i}") for i in range(materials)]
    ids = [0] * 6 + [1 + i % materials for i in range(count)]
    return quads_scene([*room((4.0, 3.0, 4.0)), *quads], [grey(0.5), *paints], ids)


def test_boxes_of_a_texel_a_side_lose_no_light(gpu: Gpu) -> None:
    """256 boxes of 0.6 m stand on a floor of 16 m, whose texels are a metre wide: what a box covers of each is no part of it, and
    rays start beside it. Within 1 %: one place stands for each texel that a box cuts."""
    boxes = merged([box((0.6,) * 3).moved(k % 16 + 0.5, 0.3, k // 16 + 0.5) for k in range(256)])
    floor, lamp = across(1, 0.0, (0, 0), (16, 16)), across(1, 8.0, (4, 4), (12, 12), along=False)
    grey_walls, light = grey(0.6), replace(grey(0.0, 10.0), name="lamp")
    scene = scene_of("boxes", [("floor", floor, grey_walls), ("boxes", boxes, grey_walls), ("lamp", lamp, light)])
    lit = gathered(gpu, scene, 96, density=1.0)
    side = lit.lightmap.pool.surfaces.area
    assert ((side > 0.3) & (side < 0.4)).sum() == 5 * 256, "a texel a side"
    assert abs(lit.book.imbalance_share) < 0.01
    lit.release()


@pytest.mark.parametrize(("count", "materials"), [(100, 1), (1024, 1), (1024, 3 * ALONE)])
def test_many_lamps_cost_no_more_rays_and_lose_no_light(gpu: Gpu, count: int, materials: int) -> None:
    """Sets of lamps get shadow rays, not lamps. The room is closed: what is emitted is absorbed, but for noise: as the variance
    says, Z = 4. What few lamps give to the texels next to them is seldom found: below 100 shadow rays the variance misses it.
    """
    lit = gathered(gpu, lamps_at_the_ceiling(count, materials), 256)
    direct = lit.rays.direct
    assert len(direct.sets) == min(materials, ALONE + 1)
    assert direct.traced == direct.count * len(direct.sets) * lit.lightmap.texel_count
    floor = np.flatnonzero(lit.object == 0)
    assert lit.H[floor, 0].std() < 0.3 * lit.H[floor, 0].mean(), "a thousand lamps light a floor evenly"
    noise = np.sqrt((lit.area**2 * lit.variance).sum()) / 100.0
    assert abs(lit.book.imbalance_share) < 4 * noise + 2 * SOLVED
    assert lit.book.escaped.max() == 0
    # bounces are those of the direct light that is known by now, not of what few rays said of it: solved again when rays double
    H, flux = lit.H, (lit.H * lit.area[:, None]).sum()
    lit.rays.set_materials(lit.lightmap.scene.materials)
    lit.step(8)
    lit.rays.settle()
    assert (lit.H * lit.area[:, None]).sum() == pytest.approx(flux, rel=noise + 2 * SOLVED)
    assert (lit.H != H).any()
    lit.release()


def test_near_lamps_are_looked_up_before_the_next_shadow_rays(gpu: Gpu, monkeypatch: pytest.MonkeyPatch) -> None:
    """When the tile pool gets another number of slots, that of all at once would make a frame stand still."""
    looked: list[int] = []
    known = NearLamps.of

    def spied(lamps: NearLamps, slots: NDArray[np.int64]) -> F32:
        looked.extend(slots.tolist())
        return known(lamps, slots)

    monkeypatch.setattr(NearLamps, "of", spied)
    lit = gathered(gpu, lamps_at_the_ceiling(64, 1), 4, density=1)
    direct, slots, none = lit.rays.direct, lit.lightmap.pool.tiles, np.zeros(0, np.int64)
    (of,) = direct.sets
    near, whole = of.reads["t_near"].read(), sorted(looked)
    assert looked
    looked.clear()
    direct.resized(Moves(slots, slots, none, none))
    assert not looked
    run_to_end(direct.shoot(PASS))
    assert sorted(looked) == whole and of.reads["t_near"].read() == near
    lit.release()


def test_a_lamp_in_many_pieces_gives_the_light_of_one(gpu: Gpu) -> None:
    """Few triangles are summed in closed form, many by their shadow rays alone: the same light, but for noise, Z = 4."""
    floor = [[0, 0, 0], [0, 0, 2], [2, 0, 2], [2, 0, 0]]
    light = []
    for n in (1, 18):
        at = np.linspace(0.5, 1.5, n + 1)
        lamp = [
            [(x, 0.5, z), (X, 0.5, z), (X, 0.5, Z), (x, 0.5, Z)]
            for x, X in itertools.pairwise(at)
            for z, Z in itertools.pairwise(at)
        ]
        scene = quads_scene([floor, *lamp], [grey(0.0), grey(0.0, 1.0)], [0] + [1] * len(lamp))
        lit = gathered(gpu, scene, 512, density=8)
        assert lit.rays.direct.sets[0].of.closed_form == (n == 1)
        on = lit.object == 0
        flux, noise = (lit.H[:, 0] * lit.area)[on].sum(), np.sqrt((lit.area**2 * lit.variance)[on].sum())
        light.append((flux, noise))
        lit.release()
    (one, none), (many, noise) = light
    assert none == pytest.approx(0, abs=1e-6) and 0 < noise < 0.01 * one
    assert abs(many - one) < 4 * noise


def test_a_lamp_with_a_picture_gives_the_light_of_its_bright_parts(gpu: Gpu) -> None:
    """Of which a picture lets one half shine, beside one that is cut in two: the same light on each wall, but for noise, Z = 4.
    Each shadow ray brings the light of the texel that it is sent to."""
    halves = Texture("halves", np.array([[[2.0] * 3, [0.0] * 3]], np.float32), wrap=("clamp", "clamp"), bilinear=False)
    lamp = np.array([(0.25, 0.875, 0.5), (0.5, 0.875, 0.5), (0.5, 0.875, 0.75), (0.25, 0.875, 0.75)])
    bright, dark = lamp.copy(), lamp.copy()
    bright[1:3, 0] = dark[[0, 3], 0] = 0.375
    whole = quads_scene(
        [*room(), lamp], [grey(0.5), replace(grey(0.0, 50.0), emission_texture=halves)], [0, 0, 0, 0, 0, 0, 1]
    )
    whole = replace(whole, uv0=((whole.corners[..., [0, 2]] - [0.25, 0.5]) * 4).astype(np.float32))  # u along x
    cut = quads_scene([*room(), bright, dark], [grey(0.5), grey(0.0, 100.0), grey(0.0)], [0, 0, 0, 0, 0, 0, 1, 2])
    flux, noise = [], []
    for scene in (whole, cut):
        lit = gathered(gpu, scene, 256, density=16)
        assert lit.rays.direct.sets[0].of.picture == (scene is whole)
        flux.append([(lit.H[:, 0] * lit.area)[lit.object == k].sum() for k in range(6)])
        noise.append([np.sqrt((lit.area**2 * lit.variance)[lit.object == k].sum()) for k in range(6)])
        lit.release()
    assert (np.abs(np.subtract(*flux)) < 4 * np.hypot(*noise) + 2 * SOLVED * np.mean(flux)).all()
    assert max(map(max, noise)) < 0.01 * np.mean(flux)
