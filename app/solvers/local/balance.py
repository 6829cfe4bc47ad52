"""What the light of the local set adds up to: where all energy is, and by how much the matrix is off."""

from __future__ import annotations

import numpy as np

from app.direct_light.shadow_rays import DirectLight
from app.lightmap.lightmap import Lightmap
from app.scene.model import F64
from app.solvers.base import EnergyBalance
from app.solvers.local.lighting import Lighting
from app.solvers.local.members import Members
from app.solvers.local.patches import Patches

LEAST = 1e-6  # 1 - λ: in a furnace of λ = 1 light never ends


def balance_of(lightmap: Lightmap, direct: DirectLight, patches: Patches, members: Members) -> EnergyBalance:
    """emitted = absorbed + escaped + imbalance, RGB [W]: escaped is the light of lamps that no texel got, and what
    texels reflect where rays start that are lost. What the sky and directional lights send to texels is what they emit. Reads
    every texel and waits for the GPU."""
    held = members.held
    area = lightmap.pool.surfaces.area[..., None]
    albedo, H = lightmap.albedo().astype(np.float64), lightmap.irradiance().astype(np.float64)
    raw = np.frombuffer(direct.light.read(), np.float32).reshape(*lightmap.size[::-1], 4)
    D = lightmap.pool.tiles_from_image(raw)[..., :3].astype(np.float64) * lightmap.unit
    nodes = held.nodes
    emitted = lightmap.emitted + direct.from_outside() + lightmap.sent_by_points
    escaped = emitted - (D * area).sum((0, 1, 2))
    if len(nodes):
        B = _in_order(lightmap, patches, albedo * H)
        lost = np.stack([(B[starts] * gone[:, None]).mean(0) for starts, gone in held.lost()])
        escaped = escaped + patches.area[nodes] @ lost * lightmap.space.scale**2
    whole = float(area.sum())
    return EnergyBalance(
        emitted=emitted,
        absorbed=((1 - albedo) * H * area).sum((0, 1, 2)),
        escaped=escaped,
        unshot=np.zeros(3),
        reflectance=(albedo * area).sum((0, 1, 2)) / max(whole, 1e-300),
        area=whole,
    )


def _in_order(lightmap: Lightmap, patches: Patches, tiles: F64) -> F64:
    """(texels, 3) in order, of tiles (tiles, t, t, 3)."""
    order, pool = patches.order, lightmap.pool
    y, x = order >> 16, order & 0xFFFF
    return np.asarray(tiles[y // pool.tile * pool.columns + x // pool.tile, y % pool.tile, x % pool.tile])


def matrix_error(lighting: Lighting, members: Members) -> float:
    """By how much the indirect light of the set is off, of the mean [-]: what storage loses, and ways of bouncing that are cut
    short. Another bounce along its form factors, in 64 bits, has the residual r; where light goes on by λ each time, the mean
    albedo times the mean of what rows sum to, |r| / (1 - λ) is off. Waits for the GPU."""
    held, there = members.held, members.held.node >= 0
    if not there.any():
        return 0.0
    indirect, first = (
        np.frombuffer(texture.read(), np.float32).reshape(-1, 4)[there, :3].astype(np.float64)
        for texture in (lighting.indirect, lighting.first)
    )
    outside, scale = (
        np.frombuffer(texture.read(), np.float32)[:3].astype(np.float64)
        for texture in (lighting.outside, lighting.scale)
    )
    received = scale * first + held.outside[there, None] * outside
    again = received + held.matrix() @ (members.albedo[held.nodes] * indirect)
    area = held.area[there, None]
    goes_on = members.mean_albedo * float(np.average(held.row_sum[there], weights=held.area[there]))
    residual = float((area * np.abs(again - indirect)).sum() / max((area * indirect).sum(), 1e-300))
    return residual / max(1.0 - goes_on, LEAST)
