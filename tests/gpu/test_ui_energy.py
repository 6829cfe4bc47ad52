"""What is wrong looks wrong: the energy balance, what is unshot, and how far a solve is."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from desks import Desk, desk, session, where
from imgui_bundle import imgui

from app.atlas.options import AtlasOptions
from app.gpu import Gpu
from app.session.balance import Verdict, verdict_of
from app.session.report import notes
from app.session.run import Stop
from app.session.session import Session
from app.solvers import SOLVERS, EnergyBalance
from app.ui import theme, widgets
from app.ui.panels import energy
from app.ui.words import plain

__all__ = ["desk", "session", "where"]


def pixels_of(desk: Desk, colour: theme.RGBA, place: slice) -> int:
    """How many of the Solver panel, or of the status bar, are of about that colour."""
    image = desk.image()[place, : 300 if place.start == 0 else None].astype(int)
    return int((np.abs(image - 255 * np.array(colour[:3])).max(axis=-1) < 8).sum())


PANEL, BAR = slice(0, 690), slice(700, 720)


@pytest.mark.parametrize(
    ("imbalance", "colour", "icon"),
    [
        (0.0001, theme.GOOD, theme.ICONS.ICON_FA_CIRCLE_CHECK),
        (-0.01, theme.AMBER, theme.ICONS.ICON_FA_TRIANGLE_EXCLAMATION),
        (0.13, theme.BAD, theme.ICONS.ICON_FA_CIRCLE_EXCLAMATION),
    ],
)
def test_an_imbalance_has_the_colour_and_sign_that_it_deserves(
    desk: Desk, monkeypatch: pytest.MonkeyPatch, imbalance: float, colour: theme.RGBA, icon: str
) -> None:
    told: list[tuple[str, theme.RGBA]] = []
    real = imgui.text_colored
    monkeypatch.setattr(
        imgui, "text_colored", lambda c, text: told.append((text, (c.x, c.y, c.z, c.w))) or real(c, text)
    )
    desk.session.imbalance = imbalance
    desk.frames(3)
    ((_, given),) = {entry for entry in told if entry[0] == f"{icon} Imbalance"}
    assert given == pytest.approx(colour)
    wrong = imbalance == 0.13
    assert (pixels_of(desk, theme.BAD, BAR) > 20) == wrong, (
        "the status bar says what is too much, whatever panel is shown"
    )
    assert (pixels_of(desk, theme.BAD, PANEL) > 200) == wrong


def test_window_and_report_say_the_same(desk: Desk, monkeypatch: pytest.MonkeyPatch) -> None:
    said: list[str] = []
    real = widgets.one_line
    monkeypatch.setattr(widgets, "one_line", lambda text, *more: said.append(text) or real(text, *more))
    desk.session.imbalance = 0.13
    desk.frames()
    run = SimpleNamespace(progress=SimpleNamespace(note=None))
    stats, family = SimpleNamespace(imbalance=0.13, remaining=0.0), desk.session.family
    (note,) = notes(SimpleNamespace(family=family, stats=stats, run=run, finer_maps=None))  # type: ignore[arg-type]
    assert plain(note) in said and note.startswith("13.0% of the light is lost: ")
    assert "--" in note and not any("--" in text for text in said)
    assert "Gathering" in plain(note) and "Density" in plain(note)


@pytest.mark.parametrize("family", SOLVERS.values(), ids=SOLVERS)
def test_little_is_fine_and_much_has_a_remedy(family) -> None:  # type: ignore[no-untyped-def]
    assert verdict_of(0.0049, family).text is None
    levels = [verdict_of(sign * share, family).level for sign in (1, -1) for share in (0.004, 0.006, 0.021)]
    assert levels == [0, 1, 2] * 2
    assert "would do" in str(verdict_of(0.1, family).text) or "lights all" in str(verdict_of(0.1, family).text)


@pytest.mark.parametrize("distributes", [True, False])
def test_shares_are_of_one_whole(distributes: bool) -> None:
    """Also where more was absorbed than emitted, since light overshoots: that is to be taken back."""
    powers = (np.full(3, power) for power in (10.0, 10.4, 0.1, -0.5))
    balance = EnergyBalance(*powers, np.zeros(3), 1.0)
    rows = energy.shares(balance, 0.05, balance.escaped, distributes=distributes)
    shown = {label: float(power.mean()) for label, power, _, _ in rows}
    if distributes:
        assert shown["Unshot"] == pytest.approx(0.5) and shown["Absorbed"] == pytest.approx(9.4)
        assert sum(shown.values()) - shown["Emitted"] == pytest.approx(10.0)
    else:
        assert "Unshot" not in shown and shown["Absorbed"] == 10.4


def test_shares_are_of_one_moment(gpu: Gpu) -> None:
    """Half of the light leaves the scene with the first shots: they were in what had escaped, and still in what was unshot. When
    the lamp is dimmed, so is all that has escaped."""
    session = Session(gpu, atlas=AtlasOptions(texels=1500))
    session.open_now("cornell-box")
    assert f"{session.run.share_done(Stop()):.0%}" == "0%", "not -0%"
    for piece in range(7):
        if piece == 4:
            session.solver.set_materials(
                tuple(replace(m, emission=tuple(0.1 * np.array(m.emission))) for m in session.materials)
            )
        else:
            session.work(8)
        balance, progress = session.solver.energy(), session.solver.poll(wait=True)
        rows = energy.shares(balance, progress.remaining, progress.escaped, distributes=True)
        emitted, *others = (float(power.sum()) for _, power, _, _ in rows)
        assert sum(others) == pytest.approx(emitted - balance.imbalance.sum(), rel=1e-3)
    assert session.solver.settle().escaped == pytest.approx(session.solver.energy().escaped)
    session.release()


def test_progress_never_goes_back_but_for_an_edit(gpu: Gpu, monkeypatch: pytest.MonkeyPatch) -> None:
    session = Session(gpu, atlas=AtlasOptions(texels=1500))
    session.open_now("cornell-box")
    seen = []
    for _ in range(60):
        session.work(1)
        session.run.poll(energy=False)
        seen.append(session.stats.progress)
    assert seen == sorted(seen) and 0 < seen[-1] < 1
    with monkeypatch.context() as back:
        back.setattr(session.solver, "poll", lambda: replace(session.run.progress, remaining=1.0))
        session.run.poll(energy=False)
        assert session.stats.remaining == 1.0 and session.stats.progress == seen[-1]
    session.solve(Stop())
    session.run.poll()
    assert session.stats.progress == 1.0 and session.stats.converged
    session.set_material(0, session.materials[1])
    assert session.stats.progress < 1
    session.release()


def test_what_a_sky_sends_in_is_said_to_be_an_estimate() -> None:
    balance = EnergyBalance(*(np.full(3, power) for power in (10.0, 5.0, 1.0, 4.0)), np.zeros(3), 1.0, estimated=True)
    (label, *_), *_ = energy.shares(balance, 0.4, balance.escaped, distributes=True)
    assert label == "Emitted, about"


def test_what_is_still_noise_or_missing_is_no_verdict() -> None:
    """A solution that has hardly begun is not called wrong; what is shot too much stays wrong."""
    gathering, shooting = SOLVERS["gathering"], SOLVERS["shooting"]
    for early in (verdict_of(-0.5, gathering, 0.9), verdict_of(-0.5, shooting, coarse=True)):
        assert not early.known and early.level == 0
    assert verdict_of(0.001, shooting, coarse=True) == Verdict(0)
    assert verdict_of(-0.5, gathering, 0.1).level == verdict_of(-0.5, shooting, 0.9).level == 2
