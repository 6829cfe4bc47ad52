"""Light of the sky by every solver that knows it, against closed forms."""

from __future__ import annotations

import numpy as np
import pytest
from solver_scenes import NOISE, Solution, begin, grey, quads_scene, room

from app.gpu import Gpu
from app.scene.model import F64, Scene
from app.scene.sky import Sky, Sun
from app.scene.sky_directions import directions_of
from app.session.balance import FINE

SKIES = ("shooting", "quadtrees", "gathering", "local")  # quadtrees: shooting on them
EVERY_SKY_SOLVER = pytest.mark.parametrize("solver", SKIES)
RAYS = 128
FLOOR = [[0, 0, 2], [2, 0, 2], [2, 0, 0], [0, 0, 0]]  # faces up
WALL = [[0, 0, 0], [2, 0, 0], [2, 2, 0], [0, 2, 0]]  # faces it, +z


def solved(gpu: Gpu, scene: Scene, solver: str) -> Solution:
    known: dict[str, object] = {
        "shooting": {"density": 8},
        "quadtrees": {"density": 4, "adaptive": True},
        "gathering": {"density": 8, "smooth": False},
        "local": {"density": 4, "shadow_rays": RAYS},
    }
    method = "shooting" if solver == "quadtrees" else solver
    lit = begin(gpu, scene, solver=method, **known[solver])  # type: ignore[arg-type]
    if solver == "gathering":
        lit.gather(RAYS)
    else:
        lit.settle()
    return lit


def wall_factor(points: F64) -> F64:
    """F from points of the floor, at (x, 0, z), to the wall: of a small surface to a rectangle that stands on its plane at a
    distance, to either side of a corner's foot [Cohen93, appendix; after Siegel & Howell, C-4]."""

    def half(width: F64) -> F64:
        z, b = points[:, 2], 2.0
        X = np.hypot(z, b)
        return np.asarray((np.arctan(width / z) - z / X * np.arctan(width / X)) / (2 * np.pi))

    return half(points[:, 0]) + half(2 - points[:, 0])


@EVERY_SKY_SOLVER
def test_an_open_plane_receives_pi_times_the_radiance(gpu: Gpu, solver: str) -> None:
    """Nothing stands before the sky: there is no noise, whatever the colour. Maps know what was sent to a sample along the
    edges."""
    scene = quads_scene([FLOOR], [grey(0.5)]).with_sky(Sky("uniform", (0.5, 1.0, 2.0), 3.0))
    lit = solved(gpu, scene, solver)
    assert np.allclose(lit.H, np.pi * 3 * np.array([0.5, 1, 2]), rtol=1e-4)
    book = lit.book
    assert np.allclose(book.emitted, 4 * np.pi * 3 * np.array([0.5, 1, 2]), rtol=1e-3)
    assert np.allclose([book.absorbed, book.escaped], book.emitted / 2, rtol=1e-3)
    lit.release()


@pytest.mark.parametrize("solver", ["shooting", "quadtrees"])
def test_what_is_sent_out_is_the_silhouette_and_what_arrives_balances_it(gpu: Gpu, solver: str) -> None:
    """Each direction sends out its irradiance times the area that a box shows to it, which maps measure by their samples, along
    its edges off by a tenth of one in the mean of many directions. On the texels as much arrives; beside the roof of a stand
    within what counts as fine: its shadow's edge lies somewhere on coarse texels."""
    sky = Sky("clear", (1.0, 0.8, 0.5), sun=Sun(60, 30))
    size = np.array([1.0, 2.0, 3.0])
    lit = solved(gpu, quads_scene(room(size)[:, ::-1], [grey(0.5)]).with_sky(sky), solver)
    towards, irradiance = directions_of(sky)
    shown = np.abs(towards) @ [size[1] * size[2], size[2] * size[0], size[0] * size[1]]
    assert np.allclose(lit.book.emitted, shown @ irradiance, rtol=1e-3)
    assert abs(lit.book.imbalance_share) < 2e-3
    lit.release()
    roof = [[0.5, 0.5, 1.5], [1.5, 0.5, 1.5], [1.5, 0.5, 0.5], [0.5, 0.5, 0.5]]
    stand = quads_scene([FLOOR, WALL, roof], [grey(0.5, double_sided=True)]).with_sky(sky)
    lit = solved(gpu, stand, solver)
    assert abs(lit.book.imbalance_share) < FINE
    lit.release()


@EVERY_SKY_SOLVER
def test_a_wall_takes_its_form_factor(gpu: Gpu, solver: str) -> None:
    """H = πL (1 - F); by RAYS rays off by about √(F (1 - F) / RAYS) / (1 - F) at worst, and by chance rather less."""
    scene = quads_scene([FLOOR, WALL], [grey(0.0, double_sided=True)]).with_sky(Sky())
    lit = solved(gpu, scene, solver)
    floor = (lit.object == 0) & (lit.normal[:, 1] > 0)
    expected = np.pi * (1 - wall_factor(lit.position[floor]))
    assert np.allclose(lit.H[floor].mean(1), expected, rtol=0.15)
    assert np.average(lit.H[floor].mean(1) / expected, weights=lit.area[floor]) == pytest.approx(1, abs=2e-3)
    lit.release()


@EVERY_SKY_SOLVER
def test_white_surfaces_under_a_white_sky_are_not_seen(gpu: Gpu, solver: str) -> None:
    """All reflect all: H = πL wherever they stand, in corners too, as long as light finds a way out."""
    scene = quads_scene([FLOOR, WALL], [grey(1.0, double_sided=True)]).with_sky(Sky())
    lit = solved(gpu, scene, solver)
    mean = np.average(lit.H.mean(1), weights=lit.area)
    assert mean == pytest.approx(np.pi, rel=5e-3)
    assert np.sqrt(np.average((lit.H.mean(1) / np.pi - 1) ** 2, weights=lit.area)) < 2 * NOISE
    assert abs(lit.book.imbalance_share) < 5e-3
    lit.release()


@EVERY_SKY_SOLVER
def test_a_bright_spot_of_the_sky_is_found(gpu: Gpu, solver: str) -> None:
    """One pixel of 512 holds nearly all light. On open ground E is that of the pixels' cosines; the roof takes its own area
    of it, wherever its shadow falls and however soft it is."""
    image = np.full((16, 32, 3), 1e-3, np.float32)
    image[3, 4] = 1000.0
    roof = [[0.5, 0.25, 1.5], [1.5, 0.25, 1.5], [1.5, 0.25, 0.5], [0.5, 0.25, 0.5]]
    scene = quads_scene([FLOOR, roof], [grey(0.0, double_sided=True)]).with_sky(Sky("image", image=image))
    lit = solved(gpu, scene, solver)
    assert scene.sky is not None
    open_ = scene.sky.shape_irradiance(np.array([[0.0, 1.0, 0.0]]))[0]
    upper = (lit.object == 1) & (lit.normal[:, 1] > 0)
    assert np.allclose(lit.H[upper], open_, rtol=2e-3)
    floor = (lit.object == 0) & (lit.normal[:, 1] > 0)
    shade = lit.H[floor].mean(1) / open_.mean()
    assert np.average(shade, weights=lit.area[floor]) == pytest.approx(0.75, abs=0.01)
    assert shade.min() < 0.01
    lit.release()


@EVERY_SKY_SOLVER
def test_the_sun_falls_on_a_floor_as_the_cosine(gpu: Gpu, solver: str) -> None:
    """E cos θ, in one colour more than in another; in the shadow of a wall that stands in its way, nothing."""
    sun = Sun(0.0, 30.0)  # behind the wall, whose shadow of 2 / tan 30° covers all of the floor
    dark = np.zeros((2, 4, 3), np.float32)
    sky = Sky("image", sun=sun, image=dark, strength=2.0)
    floor = quads_scene([FLOOR], [grey(0.5)]).with_sky(sky)
    lit = solved(gpu, floor, solver)
    expected = 0.5 * sky.sun_irradiance
    assert np.allclose(lit.H, expected, rtol=1e-3)
    # maps know what was sent to a sample along the edges, and all directions of the sun see the floor on nearly the same ones
    assert np.allclose(lit.book.emitted, 4 * expected, rtol=4e-3)
    lit.release()
    wide = [[-1, 0, 0], [3, 0, 0], [3, 2, 0], [-1, 2, 0]]
    lit = solved(gpu, quads_scene([FLOOR, wide], [grey(0.0, double_sided=True)]).with_sky(sky), solver)
    floor_, back = lit.normal[:, 1] > 0.5, lit.normal[:, 2] < -0.5
    assert np.allclose(lit.H[floor_], 0.0, atol=1e-3 * expected.max())
    assert np.allclose(lit.H[back], np.cos(np.radians(30)) * sky.sun_irradiance, rtol=1e-3)
    lit.release()


def test_the_strength_of_a_sky_costs_no_ray(gpu: Gpu) -> None:
    scene = quads_scene([FLOOR, WALL], [grey(0.5, double_sided=True)]).with_sky(Sky())
    lit = solved(gpu, scene, "gathering")
    before, traced = lit.H, lit.rays.traced
    lit.rays.set_sky(Sky("uniform", (1.0, 0.5, 0.25), 4.0))
    lit.step(8)
    lit.rays.settle()
    assert lit.rays.traced == traced
    assert np.allclose(lit.H, before * [4, 2, 1], rtol=5e-3)
    lit.rays.set_sky(None)
    lit.step(8)
    lit.rays.settle()
    assert np.abs(lit.H).max() < 1e-3 * before.max()
    lit.release()


@EVERY_SKY_SOLVER
def test_another_sky_ends_where_a_fresh_solve_ends(gpu: Gpu, solver: str) -> None:
    """Also when it comes while the last one is still being shot, and when it is dark; albedos change meanwhile."""
    scene = quads_scene([FLOOR, WALL], [grey(0.5, double_sided=True)]).with_sky(Sky("clear", sun=Sun(60, 30)))
    lit = solved(gpu, scene, solver)
    for sky in (Sky("uniform", strength=5.0), Sky("clear", sun=Sun(170, 50)), Sky(sun=Sun(100, 20))):
        lit.solver.set_sky(sky)
        lit.step(8)
    lit.solver.set_materials((grey(0.3, double_sided=True),))
    lit.solver.set_sky(Sky("clear", sun=Sun(120, 40)))
    if solver == "gathering":
        lit.gather(RAYS + 64)
    else:
        lit.settle()
    again = quads_scene([FLOOR, WALL], [grey(0.3, double_sided=True)]).with_sky(Sky("clear", sun=Sun(120, 40)))
    fresh = solved(gpu, again, solver)
    if solver == "quadtrees":  # leaves may have other places
        assert np.allclose(lit.means(lit.H), fresh.means(fresh.H), rtol=0.01)
    else:
        off = np.abs(lit.H - fresh.H).mean(1)
        assert np.average(off, weights=lit.area) < 0.01 * np.average(fresh.H.mean(1), weights=lit.area)
    assert np.allclose(lit.book.emitted, fresh.book.emitted, rtol=0.01)
    assert abs(lit.book.imbalance_share) < 0.01
    lit.solver.set_sky(None)
    lit.step(8)
    if solver == "gathering":
        lit.rays.settle()
    else:
        lit.settle()
    assert np.abs(lit.H).mean() < 5e-3 * fresh.H.mean()
    lit.release()
    fresh.release()


def test_what_is_unshot_is_one_number_while_the_sky_shoots(gpu: Gpu) -> None:
    """The share that remains is that of the books, and with what has been sent out it makes all that is emitted; so it is after
    an edit of an albedo. Light that is still to come from outside is shown: the mean irradiance is there from the first shots."""
    scene = quads_scene([FLOOR, WALL], [grey(0.5, double_sided=True)]).with_sky(Sky("clear", sun=Sun(60, 30)))
    lit = begin(gpu, scene, density=8)
    for edit in (None, grey(0.3, double_sided=True)):
        if edit is not None:
            lit.solver.set_materials((edit,))
        for _ in range(4):
            lit.step(8)
        assert lit.solver.batch.outside.left and lit.book.estimated
        now, book = lit.solver.settle(), lit.book
        # what patches overshot is less than nothing in some tiles: taken as it is in the books, by its size in what remains
        assert now.remaining == pytest.approx(book.unshot.sum() / book.emitted.sum(), rel=0.1)
        assert abs(book.imbalance_share) < 5e-3
    early = np.average(
        lit.lightmap.irradiance(ambient=True)[lit.lightmap.pool.surfaces.area > 0].mean(1), weights=lit.area
    )
    lit.settle()
    book = lit.book
    assert not book.estimated
    assert lit.solver.poll().remaining == pytest.approx(book.unshot.sum() / book.emitted.sum(), abs=1e-3)
    # what is to come is estimated by one mean for all surfaces, as the ambient term of [Cohen88] is: no closed form
    assert early == pytest.approx(np.average(lit.H.mean(1), weights=lit.area), rel=0.2)
    lit.release()


def test_no_more_than_all_is_unshot_after_an_edit_of_the_sky(gpu: Gpu) -> None:
    """What another sun takes back is to be shot, and what it gives."""
    scene = quads_scene([FLOOR, WALL], [grey(0.5, double_sided=True)]).with_sky(Sky("clear", sun=Sun(60, 30)))
    lit = solved(gpu, scene, "shooting")
    lit.solver.set_sky(Sky("clear", sun=Sun(120, 40)))
    assert lit.solver.poll().remaining == 1.0
    for _ in range(3):
        lit.step(8)
        assert 0 < lit.solver.poll(wait=True).remaining <= 1.0
    lit.release()


def test_a_sun_that_is_dragged_leaves_light_there(gpu: Gpu) -> None:
    """Each step of it changes the whole sky: what the old one takes back comes in turns with what the new one gives."""
    scene = quads_scene([FLOOR, WALL], [grey(0.5, double_sided=True)]).with_sky(Sky("clear", sun=Sun(60, 30)))
    lit = solved(gpu, scene, "shooting")
    known = lit.lightmap.pool.surfaces.area > 0
    before = float(lit.H.sum())
    for azimuth in (66, 72, 78):
        lit.solver.set_sky(Sky("clear", sun=Sun(azimuth, 30)))
        for _ in range(10):
            lit.step(8)
            assert 0.5 < lit.H.sum() / before < 1.5  # one batch is all of the sun, which is four tenths of the light
            shown = lit.lightmap.irradiance(ambient=True)[known].sum()
            assert 0.5 < shown / before < 1.5  # nothing is foreseen where what is taken back was not
            assert abs(lit.book.imbalance_share) < 0.02 and lit.solver.poll().remaining > 0.01
    lit.release()


def test_a_sun_moves_before_all_of_its_sky_has_come(gpu: Gpu) -> None:
    """The first that is taken back is the sun that was, though there is more light to come than to be taken back."""
    scene = quads_scene([FLOOR, WALL], [grey(0.5, double_sided=True)]).with_sky(Sky("clear", sun=Sun(60, 30)))
    lit = begin(gpu, scene, density=8)
    lit.step(8)  # the sun
    lit.solver.set_sky(Sky("clear", sun=Sun(120, 30)))
    outside = lit.solver.batch.outside
    for _ in range(2):
        lit.step(8)
    suns = [source for source in outside._given_now() if source.name != "sky"]
    assert len(suns) == 8 and all(shot.gives and shot.kind == "sky" for shot in outside._queue[16:])
    lit.release()


def test_light_of_the_sky_is_smoothed_by_as_much_as_it_is_noisy(gpu: Gpu) -> None:
    scene = quads_scene([FLOOR, WALL], [grey(0.0, double_sided=True)]).with_sky(Sky())
    off = []
    for smooth in (False, True):
        lit = begin(gpu, scene, solver="gathering", density=16, smooth=smooth)
        lit.gather(32)
        floor = (lit.object == 0) & (lit.normal[:, 1] > 0)
        off.append(lit.H[floor].mean(1) / (np.pi * (1 - wall_factor(lit.position[floor]))) - 1)
        lit.release()
    raw, smoothed = off
    assert np.abs(smoothed).mean() < 0.5 * np.abs(raw).mean()
    assert abs(smoothed.mean()) < 5e-3
