"""Settings that come along, measured where the answer is known in closed form."""

from __future__ import annotations

import dataclasses

from app.atlas.cuts import cut_at_contacts
from app.bench.accuracy.presets import measured
from app.gpu import Gpu
from app.reference.irradiance import choose_reference, reference_irradiance
from app.scene.load import load_scene
from app.session.settings import settings_of


def test_a_preset_is_solved_to_its_end(gpu: Gpu) -> None:
    draft = settings_of("draft")
    few_texels = dataclasses.replace(draft, tables={**draft.tables, "texels": {"texels": 3000}})
    scene = load_scene("furnace")
    kind = choose_reference(scene, None)
    scene = cut_at_contacts(scene).scene
    reference = reference_irradiance(scene, kind, 1, lambda text, share: None)
    row = measured(gpu, scene, reference, few_texels)
    assert row["noise"] <= draft.tables["gathering"]["noise"]
    assert 1000 < row["texels"] < 6000 and row["seconds"] > 0 and row["cpu_seconds"] > 0
    assert 0 < row["rms"] < 0.05, "in a furnace all rays see the same: what is off is of texels at edges"
