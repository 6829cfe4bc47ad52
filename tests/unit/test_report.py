"""What a solve says of itself in words."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from app.atlas.charts import Charts
from app.session.balance import finer_maps
from app.session.report import notes, summary
from app.solvers import SOLVERS
from app.ui import widgets
from app.ui.words import plain


def ended(solver: str, imbalance: float, note: str | None = None) -> Any:
    """A session, as far as notes ask it."""
    return SimpleNamespace(
        family=SOLVERS[solver],
        stats=SimpleNamespace(imbalance=imbalance, remaining=0.0),
        run=SimpleNamespace(progress=SimpleNamespace(note=note)),
        finer_maps=None,
    )


@pytest.mark.parametrize(("imbalance", "words"), [(0.063, "6.30% of the light is lost"), (-0.2, "comes from nothing")])
def test_light_that_is_lost_or_made_is_told(imbalance: float, words: str) -> None:
    said = notes(ended("shooting", imbalance, "leaves are out of memory"))
    assert said[0] == "leaves are out of memory"
    assert words in said[1] and "--solver gathering" in said[1]


def test_it_names_only_what_the_solver_has() -> None:
    (shooting,), (gathering,), (pairs,) = (notes(ended(name, 0.05)) for name in ("shooting", "gathering", "pairs"))
    assert "--level" in shooting and "--level" not in gathering + pairs
    assert "noise" in gathering and "--solver gathering" not in gathering


def test_it_names_finer_maps_where_much_of_the_surface_is_a_few_pixels_wide() -> None:
    """10,000 boxes of 0.6 m on a floor of 100 m, 1.8 texels/m."""
    rects = np.array([[0, 0, 180, 180]] + [[0, 0, 1, 1]] * 50_000)
    charts, few = (SimpleNamespace(chart_rects=of, density=1.8) for of in (rects, rects[:200]))
    boxes, floor = (SimpleNamespace(narrow=Charts.narrow.func(of)) for of in (charts, few))  # type: ignore[arg-type]
    wanted = [finer_maps(boxes, 142.0, of) for of in (256, 512, 1024)]  # type: ignore[arg-type]
    assert wanted == [1024, 1024, None]
    assert finer_maps(floor, 142.0, 256) is None  # type: ignore[arg-type]
    assert finer_maps(boxes, 1420.0, 2048) is None, "no finer ones can be had"  # type: ignore[arg-type]
    session = ended("shooting", 0.05)
    session.finer_maps = 1024
    assert "--resolution 1024" in notes(session)[0]


def test_an_even_balance_needs_no_word() -> None:
    assert notes(ended("shooting", 0.0049)) == []


def test_the_console_says_what_the_panel_says_in_the_same_figures() -> None:
    (said,) = notes(ended("shooting", 0.00583))
    assert "0.58% of the light is lost" in said and plain("0.58% of").startswith(widgets.percent(0.00583))
    noisy = ended("gathering", 0.019)
    noisy.stats.remaining = 0.03
    assert notes(noisy) == []


@pytest.mark.parametrize(("imbalance", "words"), [(-1e-6, "+0.00%"), (-0.012, "-1.20%")])
def test_what_is_rounded_to_zero_has_no_minus(imbalance: float, words: str) -> None:
    stats = SimpleNamespace(done=1, unit="shots", seconds=0.0, remaining=0.0, remains="unshot")
    result = {"interrupted": False, "converged": True, "texels": 9, "imbalance": imbalance, "renderer": "none"}
    assert f"energy imbalance {words}, none" in summary(
        cast(Any, SimpleNamespace(stats=stats, family=SOLVERS["shooting"])), result
    )


@pytest.mark.parametrize(
    ("solver", "work", "words"),
    [
        ("shooting", 1, "1 shot"),
        ("shooting", 1886, "1,886 shots"),
        ("gathering", 56, "56 rays a texel"),
        ("pairs", 1, "1 bounce"),
    ],
)
def test_work_is_said_in_words(solver: str, work: int, words: str) -> None:
    assert SOLVERS[solver].words(work) == words
