"""Charts that are kept: the same again, and made anew where anything differs that they follow from."""

from __future__ import annotations

import dataclasses
import sys
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import platformdirs
import pytest
from atlas_scenes import box_room, own_cache, scene_of

from app.atlas import charts_cache
from app.atlas.charts import Charts
from app.atlas.charts_cache import charts_of, kept_notes
from app.atlas.options import AtlasOptions
from app.atlas.parametrize import parametrize
from app.atlas.seams import Seams, SeamTexels
from app.scene import shapes
from app.scene.model import Camera, Material, Scene
from app.scene.sky import Sky
from app.session.loading import load
from app.util import cache
from app.util.background import CancelledError, Report

__all__ = ["own_cache"]

ATLAS = AtlasOptions(texels=3000)


@pytest.fixture
def scene(monkeypatch: pytest.MonkeyPatch) -> Scene:
    """A room with a drum, and a sheet that stands on its floor, so that this is cut."""
    monkeypatch.setattr(charts_cache, "FEWEST", 0)
    sheet = shapes.quad((-1.0, -1.5, 0.3), (1.7, 0, 0), (0, 1, 0))
    return scene_of(
        [box_room(), shapes.cylinder(0.41, 1.07, 14).moved(1, 0, 1), sheet],
        [Material("a"), Material("b", double_sided=True)],
    )


def _same(one: object, other: object) -> bool:
    """Values and types of all fields, but for what is cached beside them."""
    if isinstance(one, np.ndarray):
        return isinstance(other, np.ndarray) and one.dtype == other.dtype and np.array_equal(one, other)
    if isinstance(one, Scene | Charts | Seams | SeamTexels):
        return all(_same(getattr(one, f.name), getattr(other, f.name)) for f in dataclasses.fields(one))
    return type(one) is type(other) and one == other


def _refuse(*_: object, **__: object) -> Charts:
    raise AssertionError("makes them")


def test_what_is_kept_is_the_same_again(scene: Scene, monkeypatch: pytest.MonkeyPatch) -> None:
    first = charts_of(scene, ATLAS)
    assert len(first[0].triangles) > len(scene.triangles)
    monkeypatch.setattr(charts_cache, "parametrize", _refuse)
    again = charts_of(scene, ATLAS)
    assert all(_same(one, other) for one, other in zip(first, again, strict=True))
    assert "seam_texels" in vars(again[1]), "found anew"
    assert len(first[1].seam_texels.weight) and _same(first[1].seam_texels, again[1].seam_texels)
    assert charts_of(scene.with_materials((Material("red", albedo=(1, 0, 0)), scene.materials[1])), ATLAS)


def test_another_thread_may_write_them_meanwhile(scene: Scene, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    go, writers = threading.Event(), list[threading.Thread]()
    write = cache.write

    def wait_and_write(path: Path, arrays: cache.Arrays, report: Report) -> None:
        assert go.wait(60)
        writers.append(threading.current_thread())
        write(path, arrays, report)

    monkeypatch.setattr(cache, "write", wait_and_write)
    with cache.elsewhere(tmp_path):
        with cache.written_beside():
            first = charts_of(scene, ATLAS)
            go.set()
        monkeypatch.setattr(charts_cache, "parametrize", _refuse)
        again = charts_of(scene, ATLAS)
    assert writers and threading.main_thread() not in writers
    assert all(_same(one, other) for one, other in zip(first, again, strict=True))


@pytest.mark.parametrize("other", ["density", "sides", "moved", "roots", "sky", "camera within"])
def test_they_are_made_anew_where_they_would_differ(scene: Scene, other: str, monkeypatch: pytest.MonkeyPatch) -> None:
    charts_of(scene, ATLAS)
    monkeypatch.setattr(charts_cache, "parametrize", _refuse)
    atlas = ATLAS.replace(texels=3001) if other == "density" else ATLAS
    if other == "sides":
        scene = scene.with_materials((Material("a", double_sided=True), scene.materials[1]))
    if other == "moved":
        scene = dataclasses.replace(scene, positions=scene.positions + 1e-9)
    if other == "sky":
        scene = scene.with_sky(Sky())
    if other == "camera within":
        scene = dataclasses.replace(scene, cameras=(camera_at(0, 0, 0),))
    with pytest.raises(AssertionError, match="makes them"):
        charts_of(scene, atlas, roots=other == "roots")


def camera_at(*place: float) -> Camera:
    world_from_camera = np.eye(4)
    world_from_camera[:3, 3] = place
    return Camera("eye", world_from_camera, 1.0)


def test_a_camera_outside_may_go_elsewhere(scene: Scene, monkeypatch: pytest.MonkeyPatch) -> None:
    first = charts_of(dataclasses.replace(scene, cameras=(camera_at(0, 0, 9),)), ATLAS)
    monkeypatch.setattr(charts_cache, "parametrize", _refuse)
    assert _same(charts_of(dataclasses.replace(scene, cameras=(camera_at(0, 0, 8),)), ATLAS)[1], first[1])


@pytest.mark.parametrize("lasting", [True, False])
def test_notes_are_kept_with_charts_unless_another_try_may_do_without(
    lasting: bool, scene: Scene, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    made = charts_cache.parametrize

    def noted(*given: Any, **options: Any) -> Charts:
        return dataclasses.replace(made(*given, **options), warnings=("small",), lasting=lasting)

    monkeypatch.setattr(charts_cache, "parametrize", noted)
    with cache.elsewhere(tmp_path):
        noted_scene = dataclasses.replace(scene, warnings=("repaired",))
        first = charts_of(noted_scene, ATLAS)
        kept = kept_notes(noted_scene, ATLAS, roots=False)
    assert first[1].warnings == ("small",) and first[0].warnings[:1] == ("repaired",)
    assert kept == ((*first[0].warnings[1:], "small") if lasting else None)


def test_where_they_cannot_be_kept_one_note_says_so(scene: Scene, tmp_path: Path) -> None:
    file = tmp_path / "file"
    file.write_text("no folder")
    with cache.elsewhere(file):
        assert load(scene, ATLAS).notes == (f"what took long is not kept for next time: {file}: Not a directory",)


def test_a_damaged_file_is_made_again(scene: Scene) -> None:
    first = charts_of(scene, ATLAS)
    folder = Path(platformdirs.user_cache_dir("glowtree")) / "charts"
    newest = max(folder.glob("*.npz"), key=lambda path: path.stat().st_mtime_ns)
    newest.write_bytes(newest.read_bytes()[:1000])
    assert _same(charts_of(scene, ATLAS)[1], first[1])
    assert newest.stat().st_size > 1000


def test_progress_goes_on_and_each_stage_can_be_the_last(scene: Scene) -> None:
    told: list[tuple[str, float]] = []
    charts_of(scene, ATLAS.replace(texels=3002), progress=lambda stage, share: told.append((stage, share)))
    shares = [share for _, share in told]
    assert shares == sorted(shares) and shares[0] == 0.0 and 0.9 < shares[-1] <= 1.0
    stages = list(dict.fromkeys(stage for stage, _ in told))
    assert len(stages) >= 7

    def cancel_at(last: str) -> Callable[[str, float], None]:
        def progress(stage: str, share: float) -> None:
            if stage == last:
                raise CancelledError

        return progress

    for k, last in enumerate(stages):
        with pytest.raises(CancelledError):
            charts_of(scene, ATLAS.replace(texels=3100 + k), progress=cancel_at(last))
    for long in ("cutting where surfaces meet", "finding what lies on surfaces"):  # also within them
        assert len([stage for stage, _ in told if stage == long]) >= 4


def test_it_can_be_stopped_at_any_moment(scene: Scene) -> None:
    """Whichever report is the first that raises, it is the last."""
    told = 0

    def stop_at(last: int) -> Callable[[str, float], None]:
        def progress(stage: str, share: float) -> None:
            nonlocal told
            told += 1
            if told == last:
                raise CancelledError

        return progress

    for last in (1, 3, 5, 8, 12, 15):
        told = 0
        with pytest.raises(CancelledError):
            charts_of(scene, ATLAS.replace(texels=3200 + last), progress=stop_at(last))
        assert told == last


def test_who_stops_it_does_not_wait_for_what_is_made_beside(scene: Scene, monkeypatch: pytest.MonkeyPatch) -> None:
    stopped, through = threading.Event(), threading.Event()

    def slow(*_: object) -> None:
        stopped.wait(20)
        through.set()

    def stop(stage: str, share: float) -> None:
        if stage == "finding what lies on surfaces":
            raise CancelledError

    monkeypatch.setattr(sys.modules[parametrize.__module__], "find_seams", slow)
    with pytest.raises(CancelledError):
        charts_of(scene, ATLAS.replace(texels=3300), progress=stop)
    assert not through.is_set()
    stopped.set()
