"""The gate that every loader ends in: what it drops, repairs and refuses, at any scale."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from app.errors import SceneError
from app.scene.doubles import WINS
from app.scene.model import MOST_ALBEDO, Camera, Material, Scene, Texture
from app.scene.validate import MAX_TRIANGLES, Part, check_triangle_count, has_area, validate

SQUARE = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], float)
TRIANGLES = np.array([[0, 1, 2], [0, 2, 3]])
GREY = Material("grey")


def made(parts: list[Part], materials: list[Material] | None = None, **more: Any) -> Scene:
    return validate("file.x", "scene", parts, ["one", "two"], materials or [GREY], **more)


SHAPES: dict[str, tuple[list[list[float]], bool]] = {  # third corner of a triangle on (0,0,0), (1,0,0) -> has an area
    "right": ([[0, 1, 0]], True),
    "needle": ([[0.5, 1e-5, 0]], True),
    "short": ([[1e-4, 1e-4, 0]], True),
    "point": ([[0, 0, 0]], False),
    "line": ([[0.3, 0, 0]], False),
    "rounding of f32": ([[0.3, 6e-8, 0]], False),
    "line beyond": ([[2, 0, 0]], False),
}


@pytest.mark.parametrize("offset", [0.0, 1e3])
@pytest.mark.parametrize("scale", [1e-6, 1e-3, 1.0, 1e3, 1e6])
@pytest.mark.parametrize("name", SHAPES)
def test_area_does_not_depend_on_scale_or_place(name: str, scale: float, offset: float) -> None:
    third, solid = SHAPES[name]
    positions = (np.array([[0, 0, 0], [1, 0, 0], *third]) + offset) * scale
    assert has_area(positions, np.array([[0, 1, 2]]))[0] == solid


def test_a_triangle_too_small_for_its_scene_has_no_shape() -> None:
    tiny = np.array([[0, 0, 0], [1e-8, 0, 0], [0, 1e-8, 0]])
    assert has_area(tiny, np.array([[0, 1, 2]])).all()
    small = tiny * 1e4  # its area is 1e-8 of the scene's, yet its height is far above rounding
    mixed = np.concatenate([tiny, small, SQUARE])
    assert list(has_area(mixed, np.arange(9).reshape(3, 3))) == [False, True, True]


def test_degenerate_triangles_are_dropped_and_counted() -> None:
    part = Part(SQUARE, [*TRIANGLES, (0, 0, 1), (1, 1, 1)], uv0=SQUARE[:, :2], object_ids=np.array([0, 1, 1, 1]))
    scene = made([part])
    assert scene.warnings == ("2 of 4 triangles have no area and were dropped",)
    assert list(scene.object_ids) == [0, 1]
    assert scene.uv0 is not None and np.array_equal(scene.uv0, SQUARE[TRIANGLES][..., :2])


def test_parts_are_joined_and_unused_vertices_left_out() -> None:
    bad = np.concatenate([np.full((1, 3), np.nan), SQUARE, np.full((1, 3), np.inf)])
    scene = made([Part(SQUARE, TRIANGLES), Part(bad + 5.0, TRIANGLES + 1, 1)])
    assert len(scene.positions) == 8 and np.isfinite(scene.positions).all()
    assert np.array_equal(scene.corners[2:], SQUARE[TRIANGLES] + 5.0)
    assert scene.warnings == () and scene.triangles.dtype == np.int32


def moved(index: int, value: float) -> np.ndarray:
    positions = SQUARE.copy()
    positions[index] = value
    return positions


REFUSED: dict[str, tuple[list[Part], list[Material], str]] = {
    "nothing": ([], [GREY], "no triangles"),
    "empty": ([Part(SQUARE, np.zeros((0, 3), int))], [GREY], "no triangles"),
    "nan": ([Part(moved(3, np.nan), TRIANGLES)], [GREY], "1 of 2 triangles have a corner that is not a finite number"),
    "inf": ([Part(moved(0, np.inf), TRIANGLES)], [GREY], "2 of 2 triangles have a corner that is not a finite number"),
    "index": ([Part(SQUARE, TRIANGLES + 1)], [GREY], "index 4 is out of range: there are 4 vertices"),
    "negative": ([Part(SQUARE, TRIANGLES - 1)], [GREY], "index -1 is out of range: there are 4 vertices"),
    "material": ([Part(SQUARE, TRIANGLES, 0, 1)], [GREY], "material 1 is out of range: there are 1 materials"),
    "object": ([Part(SQUARE, TRIANGLES, 2)], [GREY], "object 2 is out of range: there are 2 objects"),
    "flat": ([Part(SQUARE * [1, 0, 0], TRIANGLES)], [GREY], "no triangle has an area (2 given)"),
    "huge": ([Part(SQUARE * 1e13, TRIANGLES)], [GREY], "the scene is 1e+13 m across"),
    "tiny": ([Part(SQUARE * 1e-13, TRIANGLES)], [GREY], "the scene is 1e-13 m across"),
    "albedo": ([Part(SQUARE, TRIANGLES)], [Material("m", (np.nan, 0, 0))], "material 'm': albedo, emission and"),
}


@pytest.mark.parametrize("name", REFUSED)
def test_refused(name: str) -> None:
    parts, materials, reason = REFUSED[name]
    with pytest.raises(SceneError) as caught:
        made(parts, materials)
    assert str(caught.value).startswith("file.x: " + reason)


def test_too_many_triangles_are_refused_before_any_work() -> None:
    check_triangle_count("file.x", MAX_TRIANGLES)
    many = np.broadcast_to(np.array([0, 1, 2]), (MAX_TRIANGLES + 1, 3))
    with pytest.raises(SceneError, match="20,000,001 triangles: at most 20,000,000 are allowed"):
        made([Part(SQUARE, many)])


def test_albedo_and_emission_are_clamped() -> None:
    scene = made([Part(SQUARE, TRIANGLES)], [Material("m", (1.5, -0.5, 0.25), (-1.0, 0.0, 2.0))])
    assert scene.materials[0].albedo == (MOST_ALBEDO, 0.0, 0.25) and scene.materials[0].emission == (0.0, 0.0, 2.0)
    assert len(scene.warnings) == 3


def test_names_become_single_printable_lines() -> None:
    camera = Camera("a\nb", np.eye(4), 1.0)
    scene = validate("f", "s", [Part(SQUARE, TRIANGLES)], ["x\ty"], [Material("\x1b[31mred")], [camera], ["w\nw"])
    assert (scene.objects, scene.cameras[0].name, scene.warnings) == (("x y",), "a b", ("w w",))
    assert scene.materials[0].name == "[31mred"


def test_only_triangles_without_coordinates_lose_their_texture() -> None:
    texture = Texture("t", np.array([[[0, 0, 0], [1, 0.5, 0]]], np.float32))
    parts = [Part(SQUARE, TRIANGLES, uv0=SQUARE[:, :2]), Part(SQUARE + 2.0, TRIANGLES, 1)]
    scene = made(parts, [Material("m", (0.5, 0.5, 1), albedo_texture=texture)])
    assert [scene.materials[i].albedo_texture is not None for i in scene.material_ids] == [True, True, False, False]
    assert scene.warnings == ("2 textured triangles without texture coordinates: the picture's mean colour is used",)
    assert scene.materials[scene.material_ids[2]].albedo == (0.25, 0.125, 0.0)
    assert scene.uv0 is not None and np.isfinite(scene.uv0).all()


def test_normals_become_unit_or_the_triangles_own() -> None:
    normals = np.array([[0, 0, 2], [0, 0, 0], [np.nan, 0, 0], [3, 0, 4]], float)
    scene = made([Part(SQUARE, TRIANGLES, normals=normals)])
    assert scene.normals is not None
    assert np.allclose(scene.normals, [[[0, 0, 1]] * 3, [[0, 0, 1], [0, 0, 1], [0.6, 0, 0.8]]])


def test_cameras_are_rigid_and_their_names_unique() -> None:
    skewed = np.array([[2, 1, 0, 3], [0, 2, 0, 4], [0, 0, 5, 5], [0, 0, 0, 1]], float)
    singular, lost = np.zeros((4, 4)), np.full((4, 4), np.nan)
    cameras = [Camera("c", skewed, 1.0), Camera("c", np.eye(4), 1.0), Camera("s", singular, 1.0)]
    cameras += [Camera("n", lost, 1.0), Camera("w", np.eye(4), 4.0)]
    scene = made([Part(SQUARE, TRIANGLES)], cameras=cameras)
    assert [c.name for c in scene.cameras] == ["c", "c 2"]
    turn = scene.cameras[0].world_from_camera[:3, :3]
    assert np.allclose(turn @ turn.T, np.eye(3)) and np.isclose(np.linalg.det(turn), 1.0)
    assert scene.warnings == ("3 cameras were dropped: singular or without a field of view",)


def test_triangles_listed_twice_are_dropped() -> None:
    """The same corners from whichever on, of one material and, if it has one, the same front. Coplanar neighbours stay."""
    positions = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0], [-0.0, 0, 0], [0, 0, 1], [1, 0, 1], [0, 1, 1]]
    triangles = [[0, 1, 2], [1, 2, 4], [0, 2, 1], [1, 3, 2], [5, 6, 7], [7, 6, 5]]
    ids = np.array([0, 0, 0, 0, 1, 1])
    materials = [Material("a"), Material("c", double_sided=True)]
    part = Part(np.array(positions, float), np.array(triangles), 0, ids)
    scene = validate("x", "x", [part], ["o"], materials)
    assert scene.material_ids.tolist() == [0, 0, 0, 1]
    np.testing.assert_array_equal(scene.triangles[:3], [[0, 1, 2], [0, 2, 1], [1, 3, 2]])
    assert scene.warnings == (
        "2 triangles repeat others (same corners and material) and were left out: light would be counted twice there",
    )


def test_of_opaque_triangles_in_one_place_one_is_kept_for_each_front() -> None:
    positions = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], float)
    names = {"wall": Material("wall"), "paint": Material("paint"), "lamp": Material("lamp", emission=(1, 1, 1))}
    names |= {"sheet": Material("sheet", double_sided=True), "film": Material("film", opacity=0.5)}
    names["panel"] = Material("panel", emission=(1, 1, 1), double_sided=True)
    materials = list(names.values())

    def kept(*stack: str) -> list[str]:
        """Of materials in one place, with a minus those that are turned."""
        rows = [[0, 2, 1] if name[0] == "-" else [1, 2, 0] for name in stack]
        ids = np.array([list(names).index(name.removeprefix("-")) for name in stack])
        scene = validate("x", "x", [Part(positions, np.array(rows), 0, ids)], ["o"], materials)
        dropped = len(stack) - len(scene.triangles)
        assert (f"{dropped} triangle in the place of one of another material was dropped{WINS}" in scene.warnings) == (
            dropped == 1
        )
        assert scene.listed is not None
        return [stack[k] for k in scene.listed]

    assert kept("wall", "paint") == ["wall"]
    assert kept("wall", "-paint") == ["wall", "-paint"]  # back to back
    assert kept("wall", "lamp") == ["lamp"]
    assert kept("wall", "sheet") == ["sheet"]
    assert kept("lamp", "-sheet") == ["lamp", "-sheet"]  # the room behind has a wall
    assert kept("paint", "sheet", "lamp", "sheet") == ["sheet", "lamp"]
    assert kept("lamp", "sheet", "-lamp") == ["lamp", "-lamp"]
    assert kept("lamp", "sheet", "panel") == ["panel"]
    assert kept("wall", "film") == ["wall", "film"]
    assert kept("wall", "-paint", "sheet", "-wall") == ["sheet"]
