"""Coarse texels that better ones replace: what may fail or change meanwhile, and what of it stays on the GPU."""

from __future__ import annotations

import dataclasses
import threading
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pytest
from coarse_light import TEXELS, better, frames, view
from gl_objects import forgotten, held

from app.atlas.options import AtlasOptions
from app.errors import UserError
from app.gpu import Gpu
from app.scene.load import load_scene
from app.scene.sky import Sky, Sun
from app.session import loading, opening
from app.session.session import Session
from app.session.view import View
from app.solvers import SOLVERS
from app.solvers.shooting.solver import Shooting

__all__ = ["better", "forgotten", "view"]


def test_coarse_texels_that_do_not_fit_leave_it_to_better_ones(
    view: View, better: threading.Event, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Neither where they cannot be made, nor uploaded, nor where the solver chosen meanwhile cannot be had."""
    session, tried = view.session, []

    def fail(*args: Any, **more: Any) -> Any:
        tried.append(args)
        raise UserError("no room")

    with monkeypatch.context() as broken:
        broken.setattr(loading, "coarse_charts", fail)
        session.open("furnace")
        frames(session, lambda: bool(tried))
        better.set()
        frames(session, lambda: session.loading is None)
    assert session.name == "Furnace" and session.message is None
    better.clear()
    with monkeypatch.context() as broken:
        broken.setattr(opening, "Lightmap", fail)
        session.open("cornell-box")
        frames(session, lambda: len(tried) == 2)
        assert session.loading is not None and session.name == "Furnace"
    better.set()
    frames(session, lambda: session.loading is None)
    assert session.name == "Cornell box" and session.message is None


def test_edits_stay_where_the_chosen_solver_cannot_be_had(
    view: View, better: threading.Event, monkeypatch: pytest.MonkeyPatch
) -> None:
    session = view.session

    def fail(name: str) -> None:
        raise UserError("no room")

    with monkeypatch.context() as broken:
        broken.setattr(session, "set_solver", fail)
        session.open("cornell-box")
        frames(session, lambda: session.opened)
        assert session.coarse and session.message == "no room"
    material = dataclasses.replace(session.materials[1], albedo=(0.1, 0.2, 0.7))
    session.set_material(1, material)
    better.set()
    frames(session, lambda: session.loading is None)
    assert session.materials[1] == material and session.message is None


def test_a_sky_over_coarse_texels_has_dark_sides_cut(view: View, better: threading.Event) -> None:
    session, read = view.session, load_scene("cornell-box")
    materials = tuple(dataclasses.replace(material, double_sided=True) for material in read.materials)
    session.open(dataclasses.replace(read, materials=materials))  # type: ignore[arg-type]  # a scene that is read goes, too
    frames(session, lambda: session.coarse)
    dark, sky = session.charts.dark_faces, Sky("uniform")
    session.set_sky(sky)
    assert dark > 0 and not session.coarse and session.loading is not None
    better.set()
    frames(session, lambda: session.loading is None)
    assert session.charts.dark_faces < dark and session.scene.sky is sky


def test_another_scene_may_be_opened_meanwhile(view: View, better: threading.Event) -> None:
    session = view.session
    session.open("cornell-box")
    frames(session, lambda: session.coarse)
    session.open("furnace")
    assert not session.coarse
    better.set()
    frames(session, lambda: session.loading is None)
    assert session.name == "Furnace"


def test_programs_draw_once_before_light_needs_them(
    gpu: Gpu, view: View, better: threading.Event, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Those of coarse light are fewer; another scene may need more, and reloaded ones have not drawn."""
    session, warmed, warm_up = view.session, [], Shooting.warm_up

    def counted(solver: Shooting) -> Iterator[None]:
        warmed.append(solver)
        return warm_up(solver)

    def warmed_for(name: str) -> int:
        """How often, where it opens in coarse texels first, then in better ones."""
        better.clear()
        warmed.clear()
        session.atlas = session.atlas.replace(texels=session.atlas.texels + 1)  # or its charts are kept
        session.open(name)
        frames(session, lambda: session.coarse)
        better.set()
        frames(session, lambda: session.loading is None)
        return len(warmed)

    monkeypatch.setattr(Shooting, "warm_up", counted)
    assert [warmed_for("furnace") for _ in range(2)] == [1, 0]
    monkeypatch.setattr(gpu.shaders, "generation", gpu.shaders.generation + 1)  # as a reload does
    assert warmed_for("furnace") == 1
    more = gpu.shaders.compiled  # a name that no program has had

    def needy(*args: Any, **options: Any) -> Shooting:
        gpu.shaders.program("imgui/present", slots={f"of {more}": "nothing"})
        return Shooting(*args, **options)

    monkeypatch.setitem(SOLVERS, "shooting", dataclasses.replace(session.family, for_coarse=needy))
    assert warmed_for("furnace") == 1


@pytest.mark.parametrize(("scene", "sky"), [("furnace", None), ("cornell-box", Sky("clear", sun=Sun(0, 20)))])
def test_programs_that_only_are_to_be_compiled_draw_next_to_nothing(
    gpu: Gpu, scene: str, sky: Sky | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Nor are they timed; and light is then as without."""
    session = Session(gpu, atlas=AtlasOptions(texels=2000), sky=sky)
    session.open_now(scene)
    session.work(40)
    light = session.lightmap.irradiance()
    session.solver.reset()
    gpu.timers.reset()
    with monkeypatch.context() as timed:
        timed.setattr(gpu.timers, "enabled", True)
        for _ in session.solver.warm_up():
            pass
        gpu.timers.flush()
    assert not gpu.timers.calls
    assert (session.lightmap.irradiance() != 0).any(-1).sum() <= 1 < (light != 0).any(-1).sum()
    session.solver.reset()
    session.restart()
    session.work(40)
    np.testing.assert_array_equal(session.lightmap.irradiance(), light)
    session.release()


def test_nothing_stays_on_the_gpu(
    gpu: Gpu, view: View, better: threading.Event, forgotten: Callable[[], list[object]]
) -> None:
    """From one opening to the next; with the first, programs have drawn all that they will."""
    session, counts = view.session, []
    for texels in (TEXELS, TEXELS + 1, TEXELS + 2):
        better.clear()
        session.atlas = AtlasOptions(texels=texels)
        session.open("furnace")
        frames(session, lambda: session.coarse and session.solver.issued > 0)
        better.set()
        frames(session, lambda: session.loading is None and session.solver.issued > 0)
        session.run.settle()
        counts.append(held(gpu))
    assert counts[1:] == counts[:1] * 2 and not forgotten()
