"""The Bake panel before a bake: what it says of texels, and which options it offers."""

from __future__ import annotations

from dataclasses import replace

import pytest
from desks import Desk, desk, session, where

from app.ui import widgets

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
