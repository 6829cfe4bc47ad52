"""Lamps that are surfaces are added, copied and taken away; everything else of a scene stays."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from app.scene.area_lamps import AreaLamp, Moved, Surfaces, keys_of, middle_of, turned, with_surfaces
from app.scene.lamp_surfaces import hangs_together, new_name, with_copy, with_rectangle, without_surfaces
from app.scene.load import load_scene
from app.scene.model import Scene
from app.session.versions import edits_of, with_edits

CORNERS = np.array([(0.2, 0.5, 0.2), (0.4, 0.5, 0.2), (0.4, 0.5, 0.5), (0.2, 0.5, 0.5)])[::-1]


@pytest.fixture(params=["plain", "per corner"])
def scene(request: pytest.FixtureRequest) -> Scene:
    """The Cornell box, in one case with all that there may be per corner."""
    box = load_scene("cornell-box")
    if request.param == "plain":
        return dataclasses.replace(box, uv0=None, uv1=None, normals=None, colours=None)
    count = len(box.triangles)
    uv, three = np.zeros((count, 3, 2), np.float32), np.ones((count, 3, 3), np.float32)
    return dataclasses.replace(box, uv0=uv, uv1=uv, normals=three, colours=three)


def area(scene: Scene, material: int) -> float:
    return float(scene.normals_areas[1][scene.material_ids == material].sum())


def consistent(scene: Scene) -> None:
    count = len(scene.triangles)
    assert scene.material_ids.max() < len(scene.materials) and scene.object_ids.max() < len(scene.objects)
    assert scene.triangles.max() < len(scene.positions)
    for name in ("material_ids", "object_ids", "uv0", "uv1", "normals", "colours", "listed"):
        value = getattr(scene, name)
        assert value is None or len(value) == count, name


def test_a_rectangle_shines_to_its_front(scene: Scene) -> None:
    lit = with_rectangle(scene, CORNERS, "area light 1", (2.0, 1.0, 0.5))
    consistent(lit)
    index = len(scene.materials)
    assert lit.materials[index].emission == (2.0, 1.0, 0.5)
    assert area(lit, index) == pytest.approx(0.06)
    assert np.allclose(lit.normals_areas[0][-2:], (0, 1, 0)) or np.allclose(lit.normals_areas[0][-2:], (0, -1, 0))
    flipped = with_rectangle(scene, CORNERS[::-1], "area light 1", (2.0, 1.0, 0.5))
    assert np.allclose(flipped.normals_areas[0][-2:], -lit.normals_areas[0][-2:])


def test_a_copy_stands_beside_and_goes_alone(scene: Scene) -> None:
    lamp = next(index for index, material in enumerate(scene.materials) if material.emits)
    two = with_copy(scene, lamp, np.array([0.0, 0.0, 0.1]), "light 1", (1.0, 2.0, 3.0))
    consistent(two)
    one, other = (two.corners[two.material_ids == index] for index in (lamp, len(scene.materials)))
    assert np.allclose(other - one, (0, 0, 0.1)) and two.materials[-1].name == "light 1"
    assert two.materials[-1].emission == (1.0, 2.0, 3.0)
    back = without_surfaces(two, [len(scene.materials)])
    consistent(back)
    assert (back.corners == scene.corners).all() and back.materials[:-1] == scene.materials


def test_materials_stay_on_their_triangles_where_others_go(scene: Scene) -> None:
    less = without_surfaces(scene, [0, 2])
    consistent(less)
    assert less.materials == scene.materials and area(less, 0) == area(less, 2) == 0
    assert area(less, 1) == area(scene, 1)
    assert without_surfaces(less, [1, 3, 4, 5]).triangles is less.triangles, "something stays"


# -- as plain values ----------------------------------------------------------------------------------------------------

PANEL = AreaLamp("area light 1", (0.3, 0.5, 0.4), (2.0, 1.0, 0.5), (0.2, 0.4), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0))


def test_a_rectangle_lies_as_it_is_told(scene: Scene) -> None:
    lit = with_surfaces(scene, Surfaces((PANEL,)))
    consistent(lit)
    index = len(scene.materials)
    assert lit.materials[index].emission == PANEL.emission and area(lit, index) == pytest.approx(0.08)
    assert np.allclose(middle_of(lit, index), PANEL.position)
    assert np.allclose(lit.normals_areas[0][-2:], PANEL.direction)
    assert np.allclose(np.ptp(PANEL.corners, axis=0), (0, 0.2, 0.4)), "width is along y, height along z"
    assert with_surfaces(scene, Surfaces()) is scene


def test_a_lamp_is_copied_and_its_original_removed(scene: Scene) -> None:
    """And the order of the two does not matter: both are said of the scene as it was read."""
    lamp = next(index for index, material in enumerate(scene.materials) if material.emits)
    key = keys_of(scene.materials)[lamp]
    copy = dataclasses.replace(PANEL, name="light 1", of=key)
    moved = with_surfaces(scene, Surfaces((copy,), (key,)))
    consistent(moved)
    assert area(moved, lamp) == 0 and area(moved, len(scene.materials)) == pytest.approx(area(scene, lamp))
    assert np.allclose(middle_of(moved, len(scene.materials)), PANEL.position)


def test_a_lamp_of_the_scene_is_moved_and_nothing_else(scene: Scene) -> None:
    lamp = next(index for index, material in enumerate(scene.materials) if material.emits)
    key, shift = keys_of(scene.materials)[lamp], (0.1, -0.2, 0.05)
    moved = with_surfaces(scene, Surfaces(moved=(Moved(key, shift), Moved(("no such", 0), shift))))
    consistent(moved)
    assert moved.materials == scene.materials and np.array_equal(moved.material_ids, scene.material_ids)
    off = moved.corners - scene.corners
    np.testing.assert_allclose(off[scene.material_ids == lamp], np.broadcast_to(shift, (2, 3, 3)), atol=1e-12)
    assert not off[scene.material_ids != lamp].any()


def test_what_shares_a_corner_hangs_together(scene: Scene) -> None:
    """The lamp of the box hangs free; its walls meet."""
    lamp = next(index for index, material in enumerate(scene.materials) if material.emits)
    assert not hangs_together(scene, lamp)
    assert all(hangs_together(scene, index) for index in set(scene.material_ids.tolist()) - {lamp} if index < 3)
    assert not hangs_together(scene, len(scene.materials)), "what is not there"


@pytest.mark.parametrize("direction", [(0.0, -2.0, 0.0), (0.0, 3.0, 0.0), (1.0, 0.5, -0.2), (0.0, 0.0, 1e-3)])
@pytest.mark.parametrize("angle", [0.0, 30.0, -179.0])
def test_a_rectangle_is_turned_and_says_how(direction: tuple[float, float, float], angle: float) -> None:
    lamp = turned(PANEL, direction, angle)
    assert np.allclose(lamp.direction, np.array(direction) / np.linalg.norm(direction)) and lamp.size == PANEL.size
    assert abs(np.dot(lamp.direction, lamp.across)) < 1e-12 and np.linalg.norm(lamp.across) == pytest.approx(1)
    assert lamp.turn == pytest.approx(angle)
    assert angle or lamp.across[1] == pytest.approx(0), "its width is level"
    assert turned(lamp, (0.0, 0.0, 0.0), 5.0) is lamp


def test_what_a_scene_has_not_is_left_out(scene: Scene) -> None:
    lost = ("no such", 0)
    copy = dataclasses.replace(PANEL, name="copy", of=lost)
    made = with_surfaces(scene, Surfaces((copy, PANEL), (lost,)))
    assert [material.name for material in made.materials[len(scene.materials) :]] == [PANEL.name]
    assert len(made.triangles) == len(scene.triangles) + 2


def test_materials_are_cut_as_finely_as_is_asked(scene: Scene) -> None:
    """Edits of other kinds do not change that, nor do scales of what the scene has not."""
    red = keys_of(scene.materials)[1]
    asked = Surfaces().with_scale(red, 2.0, 1.0).with_scale(("no such", 0), 2.0, 1.0)
    fine = with_surfaces(scene, asked)
    assert [m.lightmap_scale for m in fine.materials] == [2.0 if k == 1 else 1.0 for k in range(len(fine.materials))]
    edited = dataclasses.replace(scene.materials[1], albedo=(0.1, 0.2, 0.3))
    both = with_edits(fine.materials, {red: edited})[1]
    assert (both.albedo, both.lightmap_scale) == (edited.albedo, 2.0)
    assert asked.with_scale(red, 1.0, 1.0) == Surfaces().with_scale(("no such", 0), 2.0, 1.0), "as the file says"


def test_materials_of_one_name_are_told_apart(scene: Scene) -> None:
    names = [dataclasses.replace(scene.materials[0], name=name) for name in ("a", "b", "a", "")]
    assert keys_of(names) == [("a", 0), ("b", 0), ("a", 1), ("", 0)]


def test_edits_follow_their_materials(scene: Scene) -> None:
    red = dataclasses.replace(scene.materials[1], albedo=(0.1, 0.2, 0.3))
    edits = edits_of(scene.materials, (scene.materials[0], red, *scene.materials[2:]))
    assert edits == {keys_of(scene.materials)[1]: red}
    more = with_surfaces(scene, Surfaces((PANEL,)))
    assert with_edits(more.materials, edits) == (more.materials[0], red, *more.materials[2:])


def test_names_are_new() -> None:
    assert new_name("point", []) == "point 1"
    assert new_name("point", ["point 1", "point 3", "sun 1"]) == "point 2"
