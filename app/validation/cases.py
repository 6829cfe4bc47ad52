"""The hard cases, each with the answer that it must give: one row of CASES for each; checks.py says why it may be off."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from app.scene.model import Scene
from app.scene.shapes import transform
from app.validation import scenes
from app.validation.case import HEMICUBE, LEAST, METHODS, ONE_PROJECTION, HardCase, Method
from app.validation.checks import (
    BRIGHT,
    SAME,
    ever_darker,
    faint_room,
    glows,
    like_a_point,
    like_control,
    near_ceiling,
    one_room_lit,
    plates,
    shut,
    through_slit,
    tight,
    under_boxes,
)

ANGLES = (1, 10, 45, 90, 135, 170, 179)  # degrees
ROUNDED = "walls of one patch lose nothing at their edges; each shot adds with a rounding of 2^-24: 0.6 % after 100 000"
HALVES = "a rectangle becomes two triangles, with texels of half the area along its diagonal"
PAST = "patches of a quarter of a metre see past lamp and table from their middles"
STANDING = "a patch whose middle lies close to a foot sees too much or too little: a texel's width along the feet"
FACETS = "texels of several planes shoot and receive as if they were one"


def of(scene: Callable[[], Scene]) -> Callable[[str], Scene]:
    """The same scene in every size."""
    return lambda size: scene()


PLAIN = of(scenes.furnished)
AWAY = transform((1e6, -2e6, 1.5e6), (0, 0, 0), 1.0)


def _sized(factor: float) -> HardCase:
    matrix = np.diag([factor, factor, factor, 1.0])
    scene = of(lambda: scenes.transformed(scenes.furnished(), matrix))
    about = f"a furnished room {factor:g} m wide, against the same of 1 m"
    return HardCase(
        f"size-{factor:g}",
        about,
        scene,
        like_control(0.01, SAME),
        control=PLAIN,
        scale=factor,
        methods=ONE_PROJECTION,
        imbalance=0.02,
        imbalance_reason=PAST,
    )


def _corner(degrees: float) -> HardCase:
    about = f"two plates that meet at {degrees}°: a lamp and a black one"
    scene = of(lambda: scenes.corner(degrees))
    return HardCase(
        f"corner-{degrees}", about, scene, plates(degrees), density=(16, 64), map=(128, 256), residual=(1e-6, 1e-6)
    )


CASES: tuple[HardCase, ...] = (
    HardCase(
        "furnace-0.99",
        "a closed room that reflects 99 % and glows",
        of(lambda: scenes.furnace(0.99)),
        glows(0.99, 0.01),
        density=(4, 8),
        map=(128, 256),
        residual=(2e-2, 1e-2),
        methods=tuple(
            method for method in METHODS if method.storage != "fixed8"
        ),  # which ends at the brightest lamp, as below
    ),
    HardCase(
        "furnace-0.999",
        "a closed room that reflects 99.9 % and glows",
        of(lambda: scenes.furnace(0.999)),
        glows(0.999, 0.01),
        density=(4, 8),
        map=(128, 256),
        residual=(2e-2, 1e-3),
        # 8 bits end at the brightest lamp, a thousandth of this light
        methods=tuple(
            method for method in METHODS if method.projection in (None, HEMICUBE) and method.storage != "fixed8"
        ),
    ),
    HardCase(
        "bright-and-faint",
        "two closed rooms, one lit by 10⁶ W/m², the other by 10⁻⁶",
        of(lambda: scenes.bright_and_faint(1e6, 1e-6)),
        faint_room(1e-12),
        density=(4, 16),
        map=(256, 256),
        residual=(1e-18, 1e-18),
        rays=(512, 4096),
        methods=tuple(method for method in METHODS if not method.adaptive),
    ),
    HardCase(
        "bright-and-dim",
        "the same, the other by 10 W/m²: quadtrees are converged at 10⁻⁹ of all light",
        of(lambda: scenes.bright_and_faint(1e6, 10.0)),
        faint_room(1e-5),
        density=(4, 16),
        map=(256, 256),
        residual=(LEAST, LEAST),
        rays=(512, 4096),
        methods=tuple(method for method in METHODS if method.adaptive),
    ),
    HardCase(
        "small-lamp",
        "a lamp of a millionth of the room's surface",
        of(lambda: scenes.small_lamp(BRIGHT)),
        like_a_point,
        map=(128, 256),
    ),
    HardCase(
        "lamp-at-ceiling",
        "a lamp 10⁻⁴ of the room below its ceiling, against one in the ceiling",
        of(lambda: scenes.lamp_near_ceiling(scenes.GAP)),
        near_ceiling,
        control=of(lambda: scenes.lamp_near_ceiling(0.0)),
    ),
    HardCase(
        "boxes-on-floor",
        "boxes that stand on a floor, touch a wall, and pierce the floor",
        of(scenes.boxes_on_floor),
        under_boxes,
        imbalance=0.02,
        imbalance_reason=STANDING,
    ),
    HardCase(
        "thin-walls",
        "a sheet without thickness and a slab of 1 mm, lit from one side",
        of(scenes.thin_walls),
        one_room_lit,
        map=(128, 256),
    ),
    HardCase(
        "slivers",
        "a floor cut by strips of 1 m by 0.1 mm",
        of(scenes.slivers),
        like_control(0.01, SAME),
        control=PLAIN,
        imbalance=0.02,
        imbalance_reason=PAST,
        methods=ONE_PROJECTION,
    ),
    HardCase(
        "degenerate-duplicate",
        "triangles without area, floor and table twice",
        of(scenes.spoiled),
        like_control(0.01, SAME),
        control=PLAIN,
        imbalance=0.02,
        imbalance_reason=PAST,
        methods=ONE_PROJECTION,
    ),
    HardCase(
        "winding",
        "double-sided walls, every other triangle wound the other way",
        of(lambda: scenes.double_sided(True)),
        like_control(0.03, HALVES),
        density=(16, 32),
        imbalance=0.02,
        imbalance_reason=HALVES,
        control=of(lambda: scenes.double_sided(False)),
        methods=ONE_PROJECTION,
    ),
    HardCase(
        "t-junctions",
        "floor tiles whose corners lie within their neighbours' edges, turned",
        of(scenes.t_junctions),
        tight,
        control=of(lambda: scenes.turned(scenes.furnished())),
        imbalance=0.02,
        imbalance_reason=PAST,
    ),
    HardCase(
        "far-away",
        "a furnished room millions of metres from the origin",
        of(lambda: scenes.transformed(scenes.furnished(), AWAY)),
        like_control(0.01, SAME),
        control=PLAIN,
        imbalance=0.02,
        imbalance_reason=PAST,
        methods=ONE_PROJECTION,
    ),
    _sized(1e-6),
    _sized(1e6),
    HardCase(
        "slit",
        "two rooms joined by a slit of 1 mm",
        of(lambda: scenes.slit(scenes.SLIT)),
        through_slit,
        map=(128, 512),
        residual=(1e-6, 1e-6),
        rays=(512, 4096),
    ),
    HardCase(
        "slit-shut",
        "the same without the slit",
        of(lambda: scenes.slit(0.0)),
        shut,
        map=(128, 512),
        residual=(1e-6, 1e-6),
    ),
    HardCase("labyrinth", "five cells with doors at alternate ends, the last shut", of(scenes.labyrinth), ever_darker),
    HardCase(
        "tiny-triangles",
        "a ball of 1280 triangles (large: 81 920) in a glowing room",
        scenes.furnace_with_ball,
        glows(0.5, 0.02, FACETS),
        imbalance=0.03,
        imbalance_reason=FACETS,
        rays=(256, 2048),
    ),
    HardCase(
        "many-shots",
        "4000 shots (large: 100 000) in a room that reflects 99.9 %",
        of(lambda: scenes.furnace(0.999)),
        glows(0.999, 0.01, ROUNDED, grazes=False),
        density=(4, 4),
        map=(128, 128),
        grazes=False,
        work=(4000, 100_000),
        methods=(Method(), Method(storage="rgba16f")),
    ),
    *map(_corner, ANGLES),
)
