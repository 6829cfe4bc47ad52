"""Which materials have too few texels for their light, or too many: known light, and the line that says so."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from app.atlas.options import AtlasOptions
from app.lightmap.options import LightmapOptions
from app.session.loading import load
from app.session.texel_use import TexelUse, texel_note, texel_use


def session(texels: int, *, adaptive: bool = False) -> Any:
    """Of a Cornell box that nothing has lit yet."""
    pool = load("cornell-box", AtlasOptions(texels=texels)).pool
    return SimpleNamespace(
        scene=pool.scene, light=LightmapOptions(adaptive=adaptive), lightmap=SimpleNamespace(pool=pool)
    )


@pytest.fixture(scope="module")
def box() -> Any:
    return session(4000)


def lit(box: Any, light: np.ndarray) -> np.ndarray:
    return np.repeat(light[..., None], 3, axis=3).astype(np.float32)


def test_even_light_needs_no_more_texels(box: Any) -> None:
    """Light that grows evenly over a surface is interpolated without any error, but for that of clipped texels."""
    uses = texel_use(box, lit(box, 1 + box.lightmap.pool.surfaces.position[..., 1]))
    assert sum(use.texels for use in uses) == box.lightmap.pool.texel_count and len(uses) >= 3
    known = [use for use in uses if use.between is not None and use.halved is not None]
    assert len(known) >= 3 and all(use.between < 1e-3 and use.halved < 1e-3 for use in known)
    note = texel_note(uses)
    assert note is not None and "half along a metre would do" in note and "too few" not in note


def test_light_that_jumps_from_texel_to_texel_needs_more(box: Any) -> None:
    """Of a checker of light the second difference is twice its contrast. Half as many texels would not see it."""
    row, column = np.indices(box.lightmap.pool.surfaces.face.shape[1:])
    light = np.broadcast_to(1 + 0.5 * (-1.0) ** (row + column), box.lightmap.pool.surfaces.face.shape)
    uses = texel_use(box, lit(box, light))
    wide = [use for use in uses if use.between is not None]
    assert all(use.between == pytest.approx(0.5 * 4 / 8, rel=0.1) for use in wide)
    note = texel_note(uses)
    assert note is not None and "px wide, light off by 25" in note


def test_texels_are_as_wide_as_they_are_seen(box: Any) -> None:
    finer = session(16_000)
    dark = [np.zeros((*one.lightmap.pool.surfaces.face.shape, 3), np.float32) for one in (box, finer)]
    few, many = ({use.material: use for use in texel_use(*both)} for both in ((box, dark[0]), (finer, dark[1])))
    for name in few.keys() & many.keys():
        if few[name].seen_px is not None:
            assert few[name].seen_px == pytest.approx(2 * many[name].seen_px, rel=0.15)
    assert any(use.seen_px is not None for use in few.values())


def test_quadtrees_follow_the_light_by_themselves() -> None:
    assert texel_use(SimpleNamespace(light=LightmapOptions(adaptive=True))) == ()  # type: ignore[arg-type]


def use(name: str, **changes: Any) -> TexelUse:
    fine = {"texels": 1000, "width": 0.1, "seen_px": 4.0, "between": 0.01, "halved": 0.03, "small": 0.0}
    return TexelUse(name, **(fine | changes))


def test_the_line_names_materials_and_figures() -> None:
    assert texel_note([use("wall"), use("floor")]) is None
    assert texel_note([use("wall", seen_px=23.4, between=0.061)]) == (
        "texels: too few on wall (23 px wide, light off by 6.1% between them)"
    )
    assert texel_note([use("wall", seen_px=23.4, between=0.01)]) is None, "even light shows no texels"
    assert texel_note([use("beads", small=0.8)]) == "texels: too few on beads (80% of it smaller than a texel)"
    spare = use("ceiling", halved=0.002)
    assert texel_note([use("wall"), spare]) == ("texels: many on ceiling (half along a metre would do, off by 0.20%)")
    assert texel_note([use("wall", texels=100_000), spare]) is None, "it would spare hardly any"
    many = [use(f"{k}", seen_px=20.0 + k, between=0.5) for k in range(5)]
    note = texel_note(many)
    assert note is not None and note.endswith("2 (22 px wide, light off by 50.0% between them) and 2 more")
