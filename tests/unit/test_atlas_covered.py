"""Of opaque surfaces that overlap in one plane and face the same way, one is there."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from numpy.typing import NDArray
from solver_scenes import grey, quads_scene, room

from app.atlas.cuts import cut_at_contacts
from app.scene.model import F64, Scene

FLOOR, CEILING, CARPET = 0, 1, 6
MATERIALS = [grey(0.5), grey(0.2), grey(0.0, 10.0)]


def flat(low: tuple[float, float], high: tuple[float, float], y: float = 0.0) -> F64:
    """A rectangle in x and z that faces up."""
    (x, z), (x_end, z_end) = low, high
    return np.array([(x, y, z), (x, y, z_end), (x_end, y, z_end), (x_end, y, z)])


def scene_of(*quads: F64, materials: tuple[int, ...] = ()) -> Scene:
    """In a room 1 × 1 × 1."""
    return quads_scene([*room(), *quads], MATERIALS, [0] * 6 + list(materials or [1] * len(quads)))


def areas(scene: Scene) -> NDArray[np.float64]:
    """Of each object."""
    return np.bincount(scene.object_ids, scene.normals_areas[1], minlength=len(scene.objects))


@pytest.mark.parametrize(
    ("low", "high", "covered"),
    [
        ((0.25, 0.25), (0.75, 0.75), 0.25),
        ((0.0, 0.0), (0.5, 0.5), 0.25),
        ((0.2, 0.0), (0.7, 1.0), 0.5),
        ((0.15, 0.35), (0.85, 0.6), 0.175),
        ((0.5, 0.3), (1.2, 0.9), 0.3),
        ((0.0, 0.0), (1.0, 1.0), 1.0),
    ],
    ids=["inside", "in a corner", "from wall to wall", "oblong", "through a wall", "all of it"],
)
def test_the_floor_ends_at_a_carpet_in_its_plane(
    low: tuple[float, float], high: tuple[float, float], covered: float
) -> None:
    """Whichever corner either begins at, and so however it is divided."""
    for turn, floor_turn in ((0, 0), (1, 0), (2, 1)):
        scene = scene_of(np.roll(flat(low, high), turn, axis=0))
        corners = scene.positions.copy()
        corners[:4] = np.roll(corners[:4], floor_turn, axis=0)
        scene = dataclasses.replace(scene, positions=corners)
        cut = cut_at_contacts(scene).scene
        expected = areas(scene)
        expected[FLOOR if covered < 1 else CARPET] -= covered
        assert areas(cut) == pytest.approx(expected, abs=1e-5)
        assert any("same plane" in note for note in cut.warnings)
    again = cut_at_contacts(cut)
    assert again.scene.warnings == cut.warnings


def test_a_lamp_covers_what_is_smaller() -> None:
    panel, lamp = flat((0.4, 0.4), (0.6, 0.6)), flat((0.3, 0.3), (0.7, 0.5))
    found = areas(cut_at_contacts(scene_of(panel, lamp, materials=(1, 2))).scene)
    assert found[[FLOOR, 6, 7]] == pytest.approx([1 - 0.08 - 0.02, 0.02, 0.08], abs=1e-5)


def test_what_faces_away_or_lies_beside_or_above_stays() -> None:
    tiles = [flat((x, 0.0), (x + 0.5, 1.0), 0.5) for x in (0.0, 0.5)]
    for quads in ([flat((0.3, 0.3), (0.6, 0.6))[::-1]], [flat((0.3, 0.3), (0.6, 0.6), 1e-4)], tiles):
        scene = scene_of(*quads, materials=(1, 0)[: len(quads)])
        cut = cut_at_contacts(scene).scene
        assert areas(cut) == pytest.approx(areas(scene), abs=1e-6) and not cut.warnings
    scene = scene_of(flat((0.3, 0.3), (0.6, 0.6))).with_materials((grey(0.5, double_sided=True), grey(0.2)))
    assert cut_at_contacts(scene).scene is scene
    glass = dataclasses.replace(scene.materials[1], opacity=0.5)
    scene = scene_of(flat((0.3, 0.3), (0.6, 0.6))).with_materials((MATERIALS[0], glass))
    assert cut_at_contacts(scene).scene is scene
