"""Lamps that are surfaces are added, copied and taken away; everything else of a scene stays."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from app.scene.lamp_surfaces import new_name, with_copy, with_rectangle, without_material
from app.scene.load import load_scene
from app.scene.model import Scene
from app.session.versions import Version

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
    two = with_copy(scene, lamp, np.array([0.0, 0.0, 0.1]), "light 1")
    consistent(two)
    one, other = (two.corners[two.material_ids == index] for index in (lamp, len(scene.materials)))
    assert np.allclose(other - one, (0, 0, 0.1)) and two.materials[-1].name == "light 1"
    back = without_material(two, len(scene.materials))
    consistent(back)
    assert (back.corners == scene.corners).all() and back.materials == scene.materials


def test_materials_behind_one_that_goes_stay_on_their_triangles(scene: Scene) -> None:
    less = without_material(scene, 0)
    consistent(less)
    for index in range(1, len(scene.materials)):
        assert less.materials[index - 1] is scene.materials[index]
        assert area(less, index - 1) == pytest.approx(area(scene, index))


def test_edits_follow_their_materials() -> None:
    scene = load_scene("cornell-box")
    edited = tuple(dataclasses.replace(material, albedo=(0.1, 0.2, 0.3)) for material in scene.materials)
    kept = tuple(range(1, len(edited)))
    version = Version(
        scene, lambda scene: with_rectangle(without_material(scene, 0), CORNERS, "new", (1, 1, 1)), (*kept, None)
    )
    made = version.make(scene)
    assert not version.keeps_materials
    assert version.materials(made, edited) == (*edited[1:], made.materials[-1])


def test_names_are_new() -> None:
    assert new_name("point", []) == "point 1"
    assert new_name("point", ["point 1", "point 3", "sun 1"]) == "point 2"
