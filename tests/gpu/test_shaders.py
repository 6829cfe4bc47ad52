"""Every program compiles with whatever the tables and options can ask of it."""

from __future__ import annotations

import itertools
import re
from collections.abc import Iterator, Mapping

import pytest

from app.atlas.charts import TILES
from app.direct_light.lit import PASS
from app.gpu import Glsl, Gpu, ShaderLibrary
from app.gpu.shader import SHADERS, Source
from app.options import specs
from app.render.layers import LAYER_SHADERS
from app.render.options import TONE_MAPS
from app.render.resolve import BORDER, PLACES_WIDTH
from app.solvers.gathering.compose import RADIUS
from app.solvers.pairs.gather import CHOICES
from app.solvers.shooting.gather_points import RAY_EDGE
from app.solvers.shooting.options import MAX_LEVEL, VISIBILITIES, ShootingOptions
from app.solvers.shooting.outside_sources import BLENDED_EDGE
from app.solvers.shooting.point_spread import POINT
from app.solvers.shooting.records import BATCH, BLOCK_LEVEL, BLOCK_ROWS, CELL_LEVEL, EMITTER, GROUP, LEVELS, RECORDS
from app.solvers.shooting.see import ESCAPED_BLOCK
from app.visibility.bvh import DEEPEST
from app.visibility.projections import PROJECTIONS

OPTION = {spec.name: spec for spec in specs(ShootingOptions)}
FLAG = (False, True)
# What a host may set a define to: every choice, of a plain number its end. A define that no host sets is a constant.
DEFINES: Mapping[str, tuple[object, ...]] = {
    "VECTOR_ROWS": (16,),
    "RAYS": (4,),
    "RESOLUTION": (int(OPTION["resolution"].minimum),),
    "LEVEL": tuple(range(MAX_LEVEL + 1)),
    "HIGHEST": (MAX_LEVEL,),
    "TILE": (TILES[-1],),
    "TILE_CELLS": (TILES[-1] >> CELL_LEVEL,),
    "CELL_LEVEL": (CELL_LEVEL,),
    "BATCH": (BATCH,),
    "BLOCK_ROWS": (BLOCK_ROWS,),
    "RAY_EDGE": (RAY_EDGE,),
    "GROUP": (GROUP,),
    "BLOCK": (ESCAPED_BLOCK,),
    "BLOCK_LEVEL": (BLOCK_LEVEL,),
    "NEAREST": (POINT["NEAREST"],),
    "FINEST": (0, MAX_LEVEL),
    "LEVELS": (LEVELS,),
    "EMITTER": (EMITTER,),
    "SETTLES": FLAG,
    "KEEPS": FLAG,
    "VIEWS": tuple({p.views for p in PROJECTIONS.values()}),
    "MATERIAL_BITS": (16,),
    "ALBEDO_TEXTURE": FLAG,
    "POINT": FLAG,
    "EMISSION_TEXTURE": FLAG,
    "OVERLAY": FLAG,
    "LINEAR": FLAG,
    "LIT": FLAG,
    "BICUBIC": FLAG,
    "FOLLOWS": FLAG,
    "BORDER": tuple(sorted(set(BORDER.values()))),
    "PLACES_WIDTH": (PLACES_WIDTH,),
    "PLANAR": FLAG,
    "NEAR_FIELD": FLAG,
    "DISC": FLAG,
    "DISC_SUBDIVISION": (OPTION["discs"].maximum,),
    "COUNT": FLAG,
    "INTEGER": FLAG,
    "ANY": FLAG,
    "BOX_GRID": FLAG,
    "OPACITY": FLAG,
    "STACK": (DEEPEST,),
    "CLOSED_FORM": FLAG,
    "PASS": (PASS,),
    "PICTURE": FLAG,
    "SKY": FLAG,
    "LIGHT": FLAG,
    "LIGHTS": FLAG,
    "PIXELS": (1024,),
    "MARGIN": (4,),
    "MANY_EDGE": (1, *sorted(BLENDED_EDGE.values())),
    "GATHERED": FLAG,
    "TRACED": FLAG,
    "FORESEEN": FLAG,
    "FINER": FLAG,
    "RADIUS": (0, 1, RADIUS),
    "DEVIATIONS": (1.5,),
    "CHOICE": (0, *CHOICES.values()),
    "VISIBILITY": tuple(range(len(VISIBILITIES))),
}
SLOTS = {
    "projection": tuple(p.glsl for p in PROJECTIONS.values()),
    "vertex": tuple(p.drawing["vertex"] for p in PROJECTIONS.values()),
    "fragment": tuple(p.drawing["fragment"] for p in PROJECTIONS.values()),
    "occlusion": tuple(f"solvers/pairs/by_{way}.glsl" for way in ("rays", "voxels", "bits")),
    "layer": tuple(f"render/layers/{layer.shader}.glsl" for layer in LAYER_SHADERS.values()),
    "curve": ("render/false_colour.glsl", *(f"render/tone_maps/{name}.glsl" for name in TONE_MAPS)),
}
DRAWINGS = [p.drawing for p in PROJECTIONS.values()]
PROGRAMS = sorted(str(path.relative_to(SHADERS))[: -len(".frag.glsl")] for path in SHADERS.rglob("*.frag.glsl"))


def stages(name: str) -> list[str]:
    vertex = f"{name}.vert.glsl"
    fragment = f"{name}.frag.glsl"
    shared = "rects" if "v_corner" in (SHADERS / fragment).read_text() else "fullscreen"
    return [vertex if (SHADERS / vertex).exists() else f"common/{shared}.vert.glsl", fragment]


def fillings(name: str) -> Iterator[dict[str, str | Glsl]]:
    """Every choice for each slot of a program."""
    text = "".join((SHADERS / stage).read_text() for stage in stages(name))
    wanted = sorted(set(re.findall(r"#include <(\w+)>", text)) - RECORDS.keys())
    for files in itertools.product(*(dict.fromkeys(SLOTS[slot]) for slot in wanted)):
        filling = dict(zip(wanted, files, strict=True))
        if "vertex" not in filling or filling in DRAWINGS:  # both sides of one projection
            yield RECORDS | filling


def combinations(name: str, slots: Mapping[str, str | Glsl]) -> Iterator[dict[str, object]]:
    """Every choice for each define that a program declares with these files in its slots."""
    text = "".join(Source(SHADERS, stage, {}, slots, set()).text for stage in stages(name))
    declared = sorted(set(re.findall(r"^\s*#define (\w+)", text, re.MULTILINE)))
    for values in itertools.product(*(DEFINES[define] for define in declared)):
        yield dict(zip(declared, values, strict=True))


@pytest.mark.parametrize("program", PROGRAMS)
def test_compiles_with_everything_that_can_be_asked_of_it(gpu: Gpu, program: str) -> None:
    library = ShaderLibrary(gpu.ctx)
    compiled = [
        library.program(
            program,
            {k: int(v) if isinstance(v, float) else v for k, v in defines.items()},
            slots,
            stages(program)[0][:-10],
        )
        for slots in fillings(program)
        for defines in combinations(program, slots)
    ]
    assert len({one.glo for one in compiled}) == len(compiled) >= 1
    library.release()


def test_every_glsl_file_belongs_to_a_program() -> None:
    """No shader lies about unused."""
    used: set[str] = set()
    for name in PROGRAMS:
        for slots in fillings(name):
            for stage in stages(name):
                used |= {p.rsplit(":", 1)[0] for p in Source(SHADERS, stage, {}, slots, set())._places}
                used.add(stage)
    # a file of nothing but includes has no line of its own
    assert {str(p.relative_to(SHADERS)) for p in SHADERS.rglob("*.glsl")} <= used
