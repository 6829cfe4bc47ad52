"""Sizes and records are shared by the host and the shaders of a shot, and declared here once."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from app.gpu import Glsl, Struct, glsl_constant
from app.lightmap.lightmap import Lightmap
from app.scene.model import F64

BATCH = 8  # shooters chosen at once: choosing reads every texel, so one choice serves several shots
BLOCK_BYTES = 256  # of a shooter among uniforms: no driver asks for a coarser alignment of their blocks
BLOCK_ROWS = BLOCK_BYTES // 16  # texels of a shooter in t_shooters, padded to such a block
BLOCK_LEVEL = 2  # blocks of so many texels along each edge, as a power of 2, are summed once for patches of every size
CELL_LEVEL = 3  # a batch takes one patch at most of each cell of so many texels, as a power of 2
LEVELS = 8  # of patches, at most: a candidate has its level in units of its row
EMITTER = 16  # marks a patch that makes groups of an emitter, see patch_marks.py
GROUP = 2  # patches along the edge of a group, see emitter_groups.py
OPEN = glsl_constant("common/item.glsl", "OPEN")  # item of the open background

# origin: where it sees from; centre, edge_u, edge_v: its polygon, the parallelogram centre ± edge_u/2 ± edge_v/2, with that area,
# all in the solver space. chart: texels of others do not belong to it. patch_x, patch_y: lower corner of the patch in the tile
# pool [texels]. exitance: mean of what is shot [stored units]. signed_size: edge of the patch [texels]; negative where its texels
# do not all shoot the mean; 0: no shot.
SHOOTER = Struct(
    "Shooter",
    "vec3 origin, float area",
    "vec3 normal, uint facet",
    "vec3 centre, float chart",
    "vec3 edge_u, int patch_x",
    "vec3 edge_v, int patch_y",
    "vec3 exitance, int signed_size",
)
# Of one column of shots: power that left the scene, how many shots; power that black sides took; all that was shot; and
# what directions sent to sides with texels [stored units · area].
LEDGER = Struct("Ledger", "vec3 escaped, float shots", "vec3 blackened", "vec3 shot", "vec3 directions")
# Of the lightmap as it was: unshot: power, Σ |Σ r A| over tiles; to_shoot: of all patches, with the overshoot; strongest: of one
# patch. escaped, shots and directions: of the ledger so far.
REPORT = Struct(
    "Report",
    "float unshot, float to_shoot, float strongest",
    "vec3 escaped, float shots",
    "vec3 directions",
)

RECORDS: dict[str, str | Glsl] = {s.name.lower(): s.glsl for s in (SHOOTER, LEDGER, REPORT)}  # slots of a Pass
IN_BLOCKS = {"BATCH": BATCH, "BLOCK_ROWS": BLOCK_ROWS}  # defines of what reads shooters as uniforms
IN_PATCHES = {"BLOCK_LEVEL": BLOCK_LEVEL, "LEVELS": LEVELS}  # and of what reads candidates


@dataclass(frozen=True)
class Shot:
    """One shot that was made: the centre [m], unit normal and area [m²] of its shooter; lower corner (x, y) and edge of its patch
    in the tile pool as it was then [texels], and (u, v, u, v) of that in the virtual atlas [texels of level 0]. record:
    SHOOTER."""

    centre: F64
    normal: F64
    area: float
    corner: tuple[int, int]
    size: int
    rect: tuple[float, float, float, float]
    record: np.void


def shot_of(lightmap: Lightmap, record: np.void) -> Shot:
    """The shot of a SHOOTER on a lightmap."""
    space, corner, size = lightmap.space, (int(record["patch_x"]), int(record["patch_y"])), int(sizes_of(record))
    centre, normal = (record[name].astype(np.float64) for name in ("centre", "normal"))
    area = float(record["area"]) * space.scale**2
    return Shot(
        space.world_from_local(centre), normal, area, corner, size, lightmap.pool.atlas_rect(corner, size), record
    )


def powers_of(shooters: NDArray[np.void] | np.void) -> F64:
    """Σ |R A| of shooters (n,), summed over RGB [stored units · solver area]."""
    exitance = np.abs(shooters["exitance"].astype(np.float64))
    return np.asarray(shooters["area"].astype(np.float64) * exitance.sum(-1))


def sizes_of(shooters: NDArray[np.void] | np.void) -> NDArray[np.int64]:
    """Edges of their patches [texels], 0 for no shot."""
    return np.asarray(np.abs(shooters["signed_size"]).astype(np.int64))
