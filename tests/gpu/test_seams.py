"""Pictures show at seams what a bake holds there."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from forests import Forest

from app.atlas.seams import seam_texels
from app.cli import run
from app.gpu import Gpu
from app.lightmap.collapse import collapse
from app.lightmap.gutter import fill_gutter
from app.lightmap.seams import finished, places_and_jumps
from app.render.ages import LeafAges
from app.render.options import DisplayOptions
from app.render.resolve import BORDER, DisplayTexels
from app.render.seam_jumps import SeamJumps
from app.render.seam_texels import shown_at_seams
from app.scene.load import load_scene


@pytest.mark.parametrize("interpolation", ["bilinear", "bicubic"])
def test_seams_are_shown_as_they_are_baked(gpu: Gpu, rng: np.random.Generator, interpolation: str) -> None:
    """Of texels of one level: elsewhere, what is shown is made of fewer."""
    trees, border = Forest(gpu, load_scene("textured-room"), texels=12000), BORDER[interpolation]
    pool, charts = trees.pool, trees.pool.charts
    noise = rng.uniform(0.2, 1.0, (pool.tiles, pool.tile, pool.tile, 3))
    trees.write({"t_irradiance": noise / trees.lightmap.unit})
    options = DisplayOptions(layer="irradiance", tone_map="clamp", interpolation=interpolation, exposure=0.0)
    texels = DisplayTexels(gpu, trees.lightmap, LeafAges(pool), border)
    shown = texels.resolve("irradiance", options, scale=None, whole=True)["t_display"]
    picture = np.frombuffer(shown.read(), np.uint8).reshape(*texels.size[::-1], 4)[..., :3]
    assert set(pool.leaves.level[pool.used].tolist()) == {0}

    image, covered = collapse(pool, trees.lightmap.irradiance())
    near = seam_texels(charts.seams).texel
    x, y = near[(near >= 0).all(1)].T
    x, y = x[covered[y, x]], y[covered[y, x]]  # of two neighbours as near, others may have the other one
    baked = finished(image, covered, charts)[y, x] / np.pi
    apart = np.abs(fill_gutter(image, covered)[y, x] / np.pi - baked).max(1)
    wanted = dict(zip(zip(x.tolist(), y.tolist(), strict=True), zip(baked, apart, strict=True), strict=True))
    seen, changed = 0, 0
    bordered = pool.tile + 2 * border
    for x, y, *_ in shown_at_seams(pool, border).astype(int).tolist():
        slot = x // bordered + y // bordered * pool.columns
        u = int(pool.leaves.x[slot]) * pool.tile + x % bordered - border
        v = int(pool.leaves.y[slot]) * pool.tile + y % bordered - border
        if (u, v) not in wanted:
            continue
        colour, far = wanted[u, v]
        linear = np.where(
            colour <= 0.0031308, 12.92 * colour, 1.055 * np.maximum(colour, 0.0031308) ** (1 / 2.4) - 0.055
        )
        np.testing.assert_allclose(picture[y, x] / 255, np.clip(linear, 0, 1), atol=1.5 / 255)
        seen, changed = seen + 1, changed + (far > 0.05)
    assert seen >= len(wanted) and changed > 50
    texels.release()
    trees.lightmap.release()


def test_a_bake_says_how_far_light_jumps_at_seams(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    line = ["bake", "textured-room", "-o", str(tmp_path), "--texels", "4000", "--solver", "gathering", "--noise", "0.1"]
    assert run(line) == 0
    said, seams = capsys.readouterr().out, json.loads((tmp_path / "report.json").read_text())["seams"]
    assert f"light jumps by {seams['after'][0]:.1%} at seams ({seams['before'][0]:.1%} before" in said
    for nth in (0, 1):
        assert seams["after"][nth] < 0.5 * min(seams["before"][nth], seams["beside"][nth])


@pytest.mark.parametrize("level", [0, 1])
def test_what_is_left_is_shown_beside_seams(gpu: Gpu, rng: np.random.Generator, level: int) -> None:
    """On texels that cover something, whatever leaf they are in."""
    trees, shown = Forest(gpu, load_scene("textured-room"), texels=12000), SeamJumps(gpu)
    for _ in range(level):
        trees.grow(0.5, rng)
    trees.write_noise(rng)
    texture = shown.of(trees.lightmap, whole=True)
    left = trees.pool.tiles_from_image(np.frombuffer(texture.read(), np.float32).reshape(*texture.size[::-1], 1))[
        ..., 0
    ]
    covered = trees.pool.surfaces.area > 0
    _, jump = places_and_jumps(
        finished(*collapse(trees.pool, trees.lightmap.irradiance(ambient=True)), trees.pool.charts), trees.pool.charts
    )
    assert left.max() == pytest.approx(jump.max()) and (left > 0).sum() > 50
    assert left[covered].sum() > 0.95 * left.sum(), "a texel that a seam only touches may cover nothing"
    shown.release()
    trees.lightmap.release()
