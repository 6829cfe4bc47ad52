"""Words of the window: tooltips, messages, and controls that have no effect now."""

from __future__ import annotations

import re

import pytest
from desks import Desk, desk, session, where

from app.atlas.options import AtlasOptions
from app.bake.options import BakeOptions
from app.compare.options import ReferenceOptions
from app.lightmap.options import LightmapOptions
from app.options import Options, specs
from app.render.options import DisplayOptions
from app.session.baking import Goal
from app.session.checkpoint import CheckpointOptions
from app.solvers import SOLVERS, ShootingOptions
from app.solvers.pairs.options import PairsOptions
from app.ui import slider, widgets
from app.ui.panels.display import COMPARED
from app.ui.state import Pace
from app.ui.words import meaning, number, plain

__all__ = ["desk", "session", "where"]

BAKED = (BakeOptions, CheckpointOptions, Goal)  # of the Bake panel
SHOWN = (
    AtlasOptions,
    LightmapOptions,
    DisplayOptions,
    ReferenceOptions,
    *BAKED,
    *(f.options for f in SOLVERS.values()),
)
MACHINE = re.compile(r"--|\\d e[+-]?\\d|e[+-]\\d|true or false|whole number|unset")


@pytest.mark.parametrize("options", [*SHOWN, Pace], ids=lambda o: o.__name__)
def test_tooltips_are_for_people(options: type[Options]) -> None:
    for spec in specs(options):
        for text in (meaning(spec), spec.title):
            assert not MACHINE.search(text), f"{spec.name}: {text}"
        assert meaning(spec).startswith(meaning(spec)[0].upper()) and "efault" in meaning(spec)
        if options is not Pace and spec.name not in COMPARED:
            assert len(spec.tip.split()) >= 8, f"{spec.name}: what it does, and what it costs"
            assert not spec.tip.endswith(".") and spec.tip != spec.help
    assert len({spec.title for spec in specs(options)}) == len(specs(options))


@pytest.mark.parametrize(
    ("value", "text"),
    [(1e-5, "0.00001"), (16_000_000, "16,000,000"), (0.5, "0.5"), (-24.0, "\N{MINUS SIGN}24"), (2, "2")],
)
def test_numbers_have_no_exponent(value: float, text: str) -> None:
    assert number(value) == text


@pytest.mark.parametrize(
    ("message", "said"),
    [
        ("--keep-pairs with --senders stride", "Keep pairs with Senders stride"),
        (
            "smaller ones (--density, --level) or --solver gathering would do",
            "smaller ones (Density, Patch level) or Gathering would do",
        ),
        ("--residual 0: must be more", "Unshot at most 0: must be more"),
        ("--sky adds a sky", "Sky in the Lights panel adds a sky"),
        ("a-b, c--d and -- stay", "a-b, c--d and -- stay"),
    ],
)
def test_messages_name_controls_and_no_flags(message: str, said: str) -> None:
    assert plain(message) == said


EFFECTS = (
    (ShootingOptions(), {"discs"}),
    (ShootingOptions(form_factor="disc"), set()),
    (AtlasOptions(density=3.0), {"texels"}),
    (AtlasOptions(texels=300), set()),
    (LightmapOptions(), {"depth", "criterion", "gradient", "shadow", "budget"}),
    (LightmapOptions(adaptive=True), {"shadow"}),
    (LightmapOptions(adaptive=True, criterion="shadow"), {"gradient"}),
    (PairsOptions(senders="all"), {"window", "voxels", "directions", "merge"}),
    (PairsOptions(senders="directional"), {"window", "voxels", "merge", "keep_pairs"}),
    (PairsOptions(senders="quadtree", occlusion="voxels"), {"directions", "keep_pairs"}),
)


@pytest.mark.parametrize(
    ("options", "without"), EFFECTS, ids=lambda v: type(v).__name__ if isinstance(v, Options) else ""
)
def test_what_has_no_effect_says_why(options: Options, without: set[str]) -> None:
    reasons = {spec.name: spec.off(options) for spec in specs(type(options)) if spec.off is not None}
    assert {name for name, reason in reasons.items() if reason} == without
    for spec in specs(type(options)):
        reason = reasons.get(spec.name)
        assert reason is None or f"No effect now: {reason}." in meaning(spec, reason)


def test_a_grey_control_does_nothing_and_tells(
    desk: Desk, where: dict[str, tuple[float, float]], monkeypatch: pytest.MonkeyPatch
) -> None:
    told: list[str] = []
    real = widgets.tooltip
    monkeypatch.setattr(widgets, "tooltip", lambda text: told.append(text) or real(text))
    desk.frames()
    x, y = where["gradient"]
    desk.drag((x, y), (x + 40, y))
    desk.click(x, y, button=1)
    assert not any(call[0] == "set_light" for call in desk.session.calls)
    desk.frames(60)  # the pointer rests
    assert any("No effect now: texels are uniform" in text for text in told)
    desk.session.light = desk.session.light.replace(adaptive=True)
    desk.frames(2)
    x, y = where["gradient"]
    desk.drag((x, y), (x + 40, y))
    assert any(call[0] == "set_light" for call in desk.session.calls)


def test_quadtrees_can_be_set_before_surfaces_are_cut_into_them(
    desk: Desk, where: dict[str, tuple[float, float]]
) -> None:
    desk.frames()
    desk.click(*where["adaptive"])
    x, y = where["gradient"]
    desk.drag((x, y), (x + 40, y))
    assert desk.session.light.gradient > 0.5
    assert not desk.session.light.adaptive  # which would cut at once


@pytest.mark.parametrize(
    ("display", "grey"),
    [
        ({}, set()),
        ({"false_colour": "luminance", "false_colour_max": 9.0, "false_colour_log": False}, set()),
        ({"layer": "albedo"}, {"exposure", "tone_map"}),
        ({"layer": "error"}, {"false_colour"}),
    ],
    ids=["combined", "false colour", "albedo", "error"],
)
def test_the_display_shows_what_has_an_effect(
    desk: Desk, monkeypatch: pytest.MonkeyPatch, display: dict[str, object], grey: set[str]
) -> None:
    found: dict[str, str] = {}
    real = widgets.edit_options

    def noting(options: Options, **more: object) -> Options:
        if isinstance(options, DisplayOptions):
            found.update(more["off"])  # type: ignore[call-overload]
        return real(options, **more)  # type: ignore[arg-type]

    monkeypatch.setattr(widgets, "edit_options", noting)
    desk.session.compare()
    desk.session.display = DisplayOptions(**display)  # type: ignore[arg-type]
    desk.frames()
    assert found.keys() == grey and all(found.values())


def test_tooltips_of_numbers_say_how_they_are_moved_typed_and_put_back() -> None:
    for options in (*SHOWN, Pace):
        for spec in specs(options):
            slides = spec.type in (int, float) and not spec.choices
            assert ("double-click: type" in meaning(spec)) == slides, spec.name
            assert "right-click: back to it" in meaning(spec)
    assert "type" not in meaning(specs(ShootingOptions)[3], "a reason"), "what is grey cannot be typed"


@pytest.mark.parametrize("density", [128.4, 40.0, 0.0512, 12345.6])
def test_density_is_one_number_in_one_format(desk: Desk, monkeypatch: pytest.MonkeyPatch, density: float) -> None:
    """In the Scene panel, beside the box that gives another, and once that is given."""
    shown: dict[str, list[str]] = {"dim": [], "wrapped": [], "slide": []}
    monkeypatch.setattr(widgets, "dim", shown["dim"].append)
    monkeypatch.setattr(widgets, "wrapped", lambda text, *_: shown["wrapped"].append(text))

    def slide(label: str, value: float, ends: object, text: str) -> float:
        shown["slide"].append(text % value if "%" in text else text)
        return value

    monkeypatch.setattr(slider, "slide", slide)
    desk.session.charts.density = density
    desk.front("Scene")
    desk.front("Solver")
    desk.ui.state.atlas = AtlasOptions(density=density)
    desk.frames(2)
    found = {name: {text for text in texts if text.endswith("texels/m")} for name, texts in shown.items()}
    assert found["dim"] == found["wrapped"] == found["slide"] and len(found["dim"]) == 1
    assert not any(
        "/m" in text.replace("texels/m", "").replace("/m²", "") for texts in shown.values() for text in texts
    )
