"""``glowtree bench open``: the stages of opening, new and from the caches."""

from __future__ import annotations

import json
import subprocess
from pathlib import Path
from typing import Any

import platformdirs
import pytest
from atlas_scenes import own_cache

from app.cli import run
from app.scene import shapes

__all__ = ["own_cache"]


def test_the_second_time_nothing_is_unfolded_anew(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    ball = shapes.icosphere(0.5, 2)
    lines = [f"v {x} {y} {z}" for x, y, z in ball.positions] + [f"f {a} {b} {c}" for a, b, c in ball.triangles + 1]
    (tmp_path / "ball.obj").write_text("\n".join(lines))
    started: list[str] = []
    start = subprocess.Popen

    def counting(command: Any, **options: Any) -> Any:
        started.extend(word for word in command if word == "app.atlas.unwrap_worker")
        return start(command, **options)

    monkeypatch.setattr(subprocess, "Popen", counting)
    before = set(Path(platformdirs.user_cache_dir("glowtree")).rglob("*"))
    assert run(["bench", "open", str(tmp_path / "ball.obj"), "--light", "--texels", "2000", "--json"]) == 0
    new, again = json.loads(capsys.readouterr().out)["runs"]
    assert len(started) == 1 and (new["run"], again["run"]) == ("new", "again")
    for row in (new, again):
        stages = [row[f"{stage}_s"] for stage in ("read", "unfold", "texels", "upload")]
        assert min(stages) > 0 and sum(stages) <= row["light_s"]
        assert (
            row.get("flat_s", 0.0) < row["light_s"] and "coarse_s" not in row
        )  # so few triangles have no coarse light
    assert new["texels"] == again["texels"] > 0
    assert set(Path(platformdirs.user_cache_dir("glowtree")).rglob("*")) == before  # the user's caches are as they were
