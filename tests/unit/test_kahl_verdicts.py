"""What rows say of Kahl's conclusions: each verdict follows from numbers, and turns with them."""

from __future__ import annotations

from typing import Any

import pytest

from app.bench.papers.kahl_verdicts import verdicts
from app.util.tables import Row


def row(senders: str, window: int, seconds: float, rms: float, **more: Any) -> Row:
    known = {"size": 128, "senders": senders, "mode": senders, "window": window, "occlusion": "rays"}
    return known | {"bounce_s": seconds, "once_s": None, "kept": None, "rms": rms, "even": rms} | more


def rows(**better: Any) -> list[Row]:
    """As he found them; ``better``: numbers of one row by its name."""
    found = {
        "all": row("all", 1, 16.0, 0.05),
        "stride": row("stride", 4, 1.0, 0.10),
        "monte_carlo": row("monte-carlo", 4, 1.0, 0.07),
        "mipmapped": row("mipmapped", 4, 1.0, 0.08),
        "voxels": row("stride", 4, 0.4, 0.2, occlusion="voxels 64"),
        "kept": row("stride", 4, 0.9, 0.10, occlusion="rays, kept", once_s=1.0, kept="2.0 MiB"),
        "quadtree": row("quadtree", 4, 3.0, 0.08),
        "directional": row("directional", 1, 0.2, 0.2, mode="directional 64"),
    }
    for name, numbers in better.items():
        found[name] |= numbers
    return list(found.values())


@pytest.mark.parametrize(
    ("claim", "better"),
    [
        ("A window of 1/128", {key: {"rms": 0.051} for key in ("stride", "monte_carlo", "mipmapped")}),
        ("Monte Carlo", {"mipmapped": {"even": 0.06}}),
        ("Voxels", {"voxels": {"rms": 0.105}}),
        ("Kept pairs", {"kept": {"bounce_s": 0.1}}),
        ("A quadtree", {"quadtree": {"bounce_s": 0.5}}),
        ("Directions", {"directional": {"rms": 0.04}}),
    ],
)
def test_a_verdict_turns_with_the_numbers(claim: str, better: dict[str, Any]) -> None:
    (before,) = (line for line in verdicts(rows()) if line.startswith(claim))
    (after,) = (line for line in verdicts(rows(**better)) if line.startswith(claim))
    assert "holds here, because" in before
    assert "does not hold here, because" in after


def test_what_no_row_can_judge_is_not_judged() -> None:
    assert verdicts([]) == []
    (line,) = verdicts([row("stride", 2, 4.0, 0.1), row("stride", 4, 1.0, 0.2)])
    assert line.startswith("A window of 1/128") and "is not refuted here, because no row has 128² windows" in line
