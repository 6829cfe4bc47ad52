"""Every projection keeps its contract (app/projections/base.py): weights that sum to 1, and maps that invert each other."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from app.gpu import Gpu, Pass
from app.gpu.shader import SHADERS, ShaderLibrary
from app.projections import PROJECTIONS
from app.scene.model import F64

# One fragment per texel of the map: its weight and direction; how far each pair of functions is from inverting the other
PROBE = """
#include <projection>
layout(location = 0) out vec4 out_weight;  // direction in the shooter's frame, delta form factor
layout(location = 1) out vec4 out_trip;    // px error, axes error, depth error, 1 where view and bounds are right
const float DEPTH = 1.75;
void main() {
    vec2 px = gl_FragCoord.xy;
    int view = view_from_px(px);
    vec3 sight = sight_from_px(view, px), local = local_from_view(view, sight), point = DEPTH * sight;
    vec4 bounds = view_bounds_px(view);
    bool inside = all(greaterThan(px, bounds.xy)) && all(lessThan(px, bounds.zw));
    out_weight = vec4(normalize(local), delta_form_factor(view, px));
    out_trip = vec4(distance(px_from_view(view, point), px), distance(view_from_local(view, local), sight),
                    abs(depth_from_view(point) - DEPTH), float(inside && view_from_direction(local) == view));
}
"""
RESOLUTIONS = (64, 256, 1024)


@pytest.fixture
def probe(gpu: Gpu, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Gpu]:
    """The context with a shader folder that has ``probe`` besides all others."""
    shutil.copytree(SHADERS, tmp_path / "shaders")
    (tmp_path / "shaders" / "probe.frag.glsl").write_text(PROBE)
    library = ShaderLibrary(gpu.ctx, tmp_path / "shaders")
    monkeypatch.setattr(gpu, "shaders", library)
    yield gpu
    library.release()


def probed(gpu: Gpu, name: str, resolution: int) -> tuple[F64, F64]:
    """(texels, 4) each: what ``probe`` writes for every texel of the map."""
    projection = PROJECTIONS[name]
    size = projection.size(resolution)
    textures = [gpu.texture(size, 4, "f4") for _ in range(2)]
    target = gpu.target(*textures)
    Pass(gpu, "probe", defines={"RESOLUTION": resolution}, slots={"projection": projection.glsl}).draw(target)
    weight, trip = (np.frombuffer(t.read(), np.float32).reshape(-1, 4).astype(np.float64) for t in textures)
    gpu.release_all(target, *textures)
    return weight, trip


@pytest.mark.parametrize("resolution", RESOLUTIONS)
@pytest.mark.parametrize("name", PROJECTIONS)
def test_delta_form_factors_are_the_cosine_over_the_hemisphere(probe: Gpu, name: str, resolution: int) -> None:
    """Σ w = 1; and with x the direction, Σ w x = (0, 0, 2/3), Σ w x xᵀ = diag(1/4, 1/4, 1/2): moments of cosθ dω / π. A face
    that is turned, missing or twice there breaks them."""
    weight, _ = probed(probe, name, resolution)
    direction, w = weight[:, :3], weight[:, 3]
    # the midpoint rule on texels of 2/R: its error falls with their area, 4/R², 1e-3 at R = 64
    error = max(4 / resolution**2, 1e-6)
    assert w.min() > 0 and direction[:, 2].min() > 0
    assert w.sum() == pytest.approx(1, abs=error)
    np.testing.assert_allclose(w @ direction, [0, 0, 2 / 3], atol=error)
    np.testing.assert_allclose((w[:, None] * direction).T @ direction, np.diag([0.25, 0.25, 0.5]), atol=error)


@pytest.mark.parametrize("resolution", RESOLUTIONS)
@pytest.mark.parametrize("name", PROJECTIONS)
def test_maps_invert_each_other(probe: Gpu, name: str, resolution: int) -> None:
    _, trip = probed(probe, name, resolution)
    px_error, axes_error, depth_error, right = trip.T
    assert px_error.max() < 3 * resolution * 2e-7  # single precision, of numbers up to the map's edge
    assert axes_error.max() < 1e-6 and depth_error.max() < 1e-6
    assert right.min() == 1, f"{(right < 1).sum()} texels lie in another view than their direction"
