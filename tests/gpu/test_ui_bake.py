"""The Bake panel before a bake: what it foresees, what it says of texels, and which options it offers."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import pytest
from desks import Desk, desk, session, where

from app.ui import widgets
from app.ui.panels import bake

__all__ = ["desk", "session", "where"]


def test_it_says_where_texels_are_too_few(desk: Desk, monkeypatch: pytest.MonkeyPatch) -> None:
    said: list[str] = []
    with monkeypatch.context() as ear:
        ear.setattr(widgets, "one_line", lambda text, *_: said.append(text))
        desk.front("Bake")
    assert "Texels: too few on red wall (23 px wide, light off by 6.0% between them)" in said


def test_the_folder_of_three_is_asked_for_where_a_page_is(
    desk: Desk, where: dict[str, tuple[float, float]], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(widgets, "fold", lambda *_, **__: True)
    desk.front("Bake")
    assert "web" in where and "three" not in where
    order = desk.ui.state.order
    assert order is not None
    desk.ui.state.order = replace(order, files=order.files.replace(web=True, three="node_modules/three"))
    desk.frames(2)
    assert "three" in where


def estimates(desk: Desk, monkeypatch: pytest.MonkeyPatch) -> dict[str, str]:
    """Rows of the panel's table."""
    rows: dict[str, str] = {}
    with monkeypatch.context() as hand:
        hand.setattr(widgets, "facts", lambda name, found: rows.update(found) if name == "estimate" else None)
        desk.front("Bake")
    return rows


def test_what_is_solved_takes_no_time(desk: Desk, monkeypatch: pytest.MonkeyPatch) -> None:
    stats = vars(desk.session.stats)
    for change, said in (
        ({"converged": True}, "all is solved; files are written"),
        ({"remaining": 0.0318, "seconds": 0.1}, "not known yet"),
    ):
        monkeypatch.setattr(type(desk.session), "stats", SimpleNamespace(**stats | change))
        assert estimates(desk, monkeypatch)["Time"] == said


def test_nothing_takes_no_seconds() -> None:
    assert [bake.roughly(seconds) for seconds in (0.01, 1.4, 89, 600, 7200)] == [
        "1 s",
        "1 s",
        "89 s",
        "10 min",
        "2.0 h",
    ]


def test_a_dark_scene_has_no_time_to_be_solved_in(desk: Desk, monkeypatch: pytest.MonkeyPatch) -> None:
    scene = desk.session.scene
    scene.materials = tuple(replace(material, emission=(0.0, 0.0, 0.0)) for material in scene.materials)
    assert "Time" not in estimates(desk, monkeypatch)
