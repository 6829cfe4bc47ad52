"""Sessions are saved and opened again: edits, settings, camera and light."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from places import Place, copied, edit, emitters, place, settle

from app.bake.sky_file import write_sky
from app.errors import UserError
from app.scene.area_lamps import Surfaces
from app.scene.lights import Light
from app.scene.load import load_scene
from app.scene.sky import Sky
from app.scene.sky_image import read_sky_image
from app.session.baking import DONE, SOLVING, Baking, Order
from app.ui import area_edits, new_lamps

__all__ = ["place"]


@pytest.mark.parametrize("solver", ["shooting", "gathering"])
def test_a_session_comes_back_with_its_light(place: Callable[..., Place], tmp_path: Path, solver: str) -> None:
    first = place()
    first.session.set_solver(solver)
    first.open("cornell-box")
    edit(first) if solver == "shooting" else first.session.set_material(
        1, dataclasses.replace(first.session.materials[1], albedo=(0.1, 0.2, 0.3))
    )
    while first.session.solver.issued < 40 and not first.session.run.converged:
        first.session.work(8)
    first.session.run.seconds = 33.0
    light = first.session.lightmap.irradiance()
    assert first.keeping.unsaved(first.view)
    first.session.lightmap.refresh_ambient(wait=True)  # as a drawn frame has: kept light knows none
    file = first.save(tmp_path / "mine")
    assert file == tmp_path / "mine.glow" and not first.keeping.unsaved(first.view)
    assert [p.name for p in tmp_path.iterdir()] == ["mine.glow"]

    second = place().open(file)
    assert second.notes == [] and second.session.message is None
    assert second.session.solver_name == solver and second.session.options == first.session.options
    assert second.session.asked_cut == first.session.asked_cut
    assert second.session.materials[1].albedo == (0.1, 0.2, 0.3)
    assert second.session.edited_scene.lights == first.session.edited_scene.lights
    assert second.state.pace == first.state.pace and second.view.display == first.view.display
    np.testing.assert_array_equal(second.view.camera.world_from_camera, first.view.camera.world_from_camera)
    assert second.view.camera.distance == first.view.camera.distance
    assert second.view.bookmarks.keys() == first.view.bookmarks.keys()
    np.testing.assert_array_equal(second.session.lightmap.irradiance(), light)
    assert second.session.solver.issued == first.session.solver.issued and second.session.run.seconds == 33.0
    assert second.keeping.path == file and not second.keeping.unsaved(second.view)


def test_a_session_without_work_is_solved_anew(place: Callable[..., Place], tmp_path: Path) -> None:
    first = place().open("cornell-box")
    edit(first)
    second = place().open(first.save(tmp_path / "a.glow"))
    assert second.notes == [] and second.session.solver.issued == 0
    assert second.session.materials[1].albedo == (0.1, 0.2, 0.3)


def test_a_folder_that_was_moved_keeps_its_session(place: Callable[..., Place], tmp_path: Path) -> None:
    first = place().open(copied(tmp_path / "old"))
    edit(first)
    first.session.work(4)
    first.save(tmp_path / "old" / "a.glow")
    (tmp_path / "old").rename(tmp_path / "new")
    second = place().open(tmp_path / "new" / "a.glow")
    assert second.notes == [] and second.session.source == tmp_path / "new" / "room.toml"
    assert second.session.solver.issued == first.session.solver.issued
    (tmp_path / "new" / "room.toml").unlink()
    with pytest.raises(UserError, match=r"a.glow: its scene .*room.toml is not there"):
        place().open(tmp_path / "new" / "a.glow")


def test_edits_find_their_materials_in_a_scene_that_has_changed(place: Callable[..., Place], tmp_path: Path) -> None:
    scene = copied(tmp_path)
    first = place().open(scene)
    red, green = (next(i for i, m in enumerate(first.session.materials) if m.name == name) for name in ("red", "green"))
    for index in (red, green):
        first.session.set_material(index, dataclasses.replace(first.session.materials[index], albedo=(0.1, 0.2, 0.3)))
    first.session.work(4)
    first.save(tmp_path / "a.glow")
    scene.write_text(scene.read_text().replace('"green"', '"lime"'))
    second = place().open(tmp_path / "a.glow")
    albedos = {material.name: material.albedo for material in second.session.materials}
    assert albedos["red"] == (0.1, 0.2, 0.3) != albedos["lime"]
    changed, lost, light = second.notes
    assert "room.toml has changed" in changed and "no green any more" in lost and "another scene" in light
    assert second.session.solver.issued == 0


def test_lamps_with_area_come_back_with_their_light(place: Callable[..., Place], tmp_path: Path) -> None:
    """One that was copied and edited, and one under the ceiling, in the place of the scene's own."""
    one = place().open("cornell-box")
    own = emitters(one)[0]
    area_edits.duplicate(one.view, one.state, own)
    settle(one)
    new_lamps.KINDS[0].add(one.view, one.state)
    settle(one)
    area_edits.remove(one.view, own)
    settle(one)
    copy, ceiling = emitters(one)
    one.session.set_material(copy, dataclasses.replace(one.session.materials[copy], emission=(3.0, 2.0, 1.0)))
    one.session.work(8)
    one.session.run.settle()
    assert one.keeping.unsaved(one.view)
    file = one.save(tmp_path / "a.glow")
    assert not one.keeping.unsaved(one.view)
    light = one.session.lightmap.irradiance()

    two = place().open(file)
    assert two.notes == [] and two.session.message is None and two.session.surfaces == one.session.surfaces
    both = ([dataclasses.asdict(material) for material in each.session.materials] for each in (one, two))
    assert next(both) == next(both) and emitters(two) == [copy, ceiling]
    np.testing.assert_array_equal(two.session.scene.corners, one.session.scene.corners)
    assert two.session.solver.issued == one.session.solver.issued > 0
    np.testing.assert_array_equal(two.session.lightmap.irradiance(), light)
    assert not two.keeping.unsaved(two.view)
    two.session.change_surfaces(Surfaces())
    settle(two)
    assert emitters(two) == [own], "as the scene is"


def test_a_bake_that_was_stopped_goes_on_in_a_session_that_was_opened_again(
    place: Callable[..., Place], tmp_path: Path
) -> None:
    """With a lamp that was added, and a material cut more finely."""
    one, folder = place().open("cornell-box"), tmp_path / "baked"
    new_lamps.KINDS[0].add(one.view, one.state)
    settle(one)
    one.session.change_surfaces(one.session.surfaces.with_scale(("red", 0), 2.0, 1.0))
    settle(one)

    def solved(at: Place, baking: Baking, until: Callable[[], bool]) -> None:
        def turn() -> bool:
            at.session.advance(fast=True)
            baking.poll()
            return until()

        at.frames_until(turn)

    baking = Baking(one.session, Order(folder))
    solved(one, baking, lambda: one.session.run.progress.done > 30)
    baking.stop()
    done = one.session.solver.poll(wait=True).done
    two = place().open(one.save(tmp_path / "a.glow"))
    assert two.notes == [] and two.session.surfaces == one.session.surfaces
    baking = Baking(two.session, Order(folder), resume=True)
    solved(two, baking, lambda: baking.stage == SOLVING)
    assert two.session.solver.poll(wait=True).done >= done > 0  # reports are on their way as they were
    solved(two, baking, lambda: not baking.active)
    assert baking.stage == DONE, baking.note
    assert sorted(path.name for path in folder.iterdir()) == ["irradiance.exr", "report.json", "scene.glb"]
    red = next(m for m in load_scene(folder / "scene.glb").materials if m.name == "red")
    assert red.lightmap_scale == 2.0


def test_texel_densities_come_back(place: Callable[..., Place], tmp_path: Path) -> None:
    one = place().open("cornell-box")
    one.session.change_surfaces(Surfaces().with_scale(("red", 0), 2.0, 1.0))
    settle(one)
    one.session.work(4)
    one.session.run.settle()
    two = place().open(one.save(tmp_path / "a.glow"))
    assert two.notes == [] and two.session.surfaces == one.session.surfaces
    assert two.session.solver.issued == one.session.solver.issued > 0
    np.testing.assert_array_equal(two.session.lightmap.irradiance(), one.session.lightmap.irradiance())


def test_a_lamp_of_the_scene_that_was_moved_comes_back_there(place: Callable[..., Place], tmp_path: Path) -> None:
    """It is the same material with its edits, somewhere else; moved back, the scene is as it was read."""
    one = place().open("cornell-box")
    own = emitters(one)[0]
    assert area_edits.why_not_moved(one.view, one.state, own) is None
    lamp = area_edits.lamp_of(one.view, one.state, own)
    x, y, z = lamp.position
    area_edits.put(one.view, own, dataclasses.replace(lamp, position=(x + 0.05, y - 0.1, z)))
    settle(one)
    moved = area_edits.lamp_of(one.view, one.state, own)
    assert emitters(one) == [own] and moved.position == pytest.approx((x + 0.05, y - 0.1, z))
    two = place().open(one.save(tmp_path / "a.glow"))
    assert two.notes == [] and two.session.surfaces == one.session.surfaces != Surfaces()
    np.testing.assert_array_equal(two.session.scene.corners, one.session.scene.corners)
    area_edits.put(two.view, own, lamp)
    settle(two)
    assert two.session.surfaces == Surfaces()


def test_lamps_of_a_scene_that_has_changed_are_said(place: Callable[..., Place], tmp_path: Path) -> None:
    scene = copied(tmp_path)
    one = place().open(scene)
    lamp = emitters(one)[0]
    name = one.session.materials[lamp].name
    area_edits.duplicate(one.view, one.state, lamp)
    settle(one)
    one.save(tmp_path / "a.glow")
    scene.write_text(scene.read_text().replace(f'"{name}"', '"another"'))
    two = place().open(tmp_path / "a.glow")
    assert any(f"no {name} any more: what was made of its surfaces is lost" in note for note in two.notes)
    assert len(two.session.materials) == len(one.session.materials) - 1


def test_lights_for_which_a_scene_was_cut_anew_are_kept(place: Callable[..., Place], tmp_path: Path) -> None:
    """A session whose surfaces have sides that only lamps without area light."""
    scene = copied(tmp_path)
    scene.write_text(scene.read_text().replace('name = "white"', 'name = "white"\ndouble_sided = true', 1))
    one = place().open(scene)
    assert one.session.charts.dark_faces > 0
    one.session.set_lights((Light("bulb", intensity=(1.0, 0.5, 0.25), position=(0.1, 0.2, 0.3)),))
    settle(one)
    assert one.session.charts.dark_faces == 0
    one.session.work(8)
    one.session.run.settle()
    two = place().open(one.save(tmp_path / "a.glow"))
    assert two.notes == [] and two.session.edited_scene.lights == one.session.edited_scene.lights
    assert two.session.solver.issued == one.session.solver.issued > 0


def test_the_picture_of_a_sky_goes_with_the_session(place: Callable[..., Place], tmp_path: Path) -> None:
    """By its place beside the session's file; where it has changed, or is gone, that is said."""
    picture = tmp_path / "sky.exr"
    half = Sky("image", image=np.linspace(0, 1, 8 * 16 * 3, dtype=np.float32).reshape(8, 16, 3))
    write_sky(picture, half)
    one = place()
    one.session.sky = Sky("image", image=read_sky_image(picture), name=picture.name, path=picture)
    scene = copied(tmp_path)
    one.open(scene)
    one.session.set_sky(dataclasses.replace(one.session.sky, strength=2.0, rotation=90.0))
    one.save(tmp_path / "a.glow")
    (tmp_path / "there").mkdir()
    for name in ("a.glow", "sky.exr", scene.name):
        (tmp_path / name).rename(tmp_path / "there" / name)
    file = tmp_path / "there" / "a.glow"
    two = place().open(file)
    sky = two.session.edited_scene.sky
    assert two.notes == [] and sky is not None and sky.image is not None
    assert np.array_equal(sky.image, one.session.sky.image) and (sky.strength, sky.rotation) == (2.0, 90.0)
    write_sky(tmp_path / "there" / "sky.exr", dataclasses.replace(half, strength=3.0))
    assert any("sky.exr" in note and "has changed" in note for note in place().open(file).notes)
    (tmp_path / "there" / "sky.exr").unlink()
    three = place().open(file)
    assert any("the picture of its sky is not there" in note for note in three.notes)
    assert three.session.edited_scene.sky is None


def test_a_failed_scene_leaves_all_as_it_was(place: Callable[..., Place], tmp_path: Path) -> None:
    scene = copied(tmp_path)
    one = place().open(scene)
    edit(one)
    one.save(tmp_path / "a.glow")
    scene.write_text("nonsense")
    two = place().open("furnace")
    open_now = two.session.unedited
    two.open(tmp_path / "a.glow")
    assert two.session.unedited is open_now and two.keeping.path is None and "not TOML" in (two.session.message or "")
