"""The hard cases, each with the answer that it must give and why it may be off: one line of CASES for each.

What a case claims is a closed form, the answer of a clean scene beside it (its twin), darkness, or an order of brightness.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from app.bench import hard_scenes as scenes
from app.bench.hard_case import EACH, LEAST, SOLVERS_ONLY, WAYS, Claim, HardCase, Light, Way, dark, near
from app.reference.form_factors import point_to_polygon
from app.scene.model import Scene
from app.scene.shapes import FACES, transform
from app.solvers import DEFAULT_SOLVER

Claims = Callable[[Light, Light], list[Claim]]

BRIGHT = 1e6  # W/m²
ANGLES = (1, 10, 45, 90, 135, 170, 179)  # degrees
SUMS = "form factors of a shooter sum to 1 within 0.5 %, on average far better, and errors repeat at each bounce"
ORDER = "the rooms are alike, shots come in another order; 32-bit floats hold 10^-38"
RIM = "the rim of a map drawn in straight pieces is open by a sample or two, 1/R² each: a limit of this projection"
LAMP = "a lamp of one texel lies at that texel's centroid, sampled within its width"
HINGE = "next to the hinge light changes within a texel; at 179° all sight is within two samples of the plane"
ENDS = "light leaves at the ends of plates that are as long as wide"
MISSED = "a slit far narrower than a pixel of the map is missed, or counts as some pixels: a limit of visibility maps"
HALVES = "a rectangle becomes two triangles, with texels of half the area along its diagonal"
CRACKS = "where an edge ends within another's, rounding may open single samples of the map"
EDGE = "a texel that a surface cuts is lit or dark by its centroid"
GRAZING = "sight within two samples, 4/R, of a receiver's own plane may pass what stands on it: (4/R)² of its sky"
PAST = "patches of a quarter of a metre see past lamp and table from their middles"
SAME = "which of two equal patches shoots first is chance, and as much as the residual is still unshot"
STANDING = "a patch whose middle lies close to a foot sees too much or too little: a texel's width along the feet"
FACETS = "texels of several planes shoot and receive as if they were one"


def of(scene: Callable[[], Scene]) -> Callable[[str], Scene]:
    """The same scene in every size."""
    return lambda size: scene()


# -- closed forms ------------------------------------------------------------------------------------------------------


def glows(albedo: float, tolerance: float, reason: str = SUMS) -> Claims:
    """B = E / (1 - ρ), here of E = 1. What is unshot makes as much more, at every moment: H = (E - r) / (1 - ρ) on average."""

    def claims(light: Light, _: Light) -> list[Claim]:
        mean = light.mean(light.area > 0) * (1 - albedo) + light.share("unshot")
        B = 1.0 + albedo * light.H
        return [
            near(
                "mean B, once all is shot, x (1 - ρ) / E",
                1 + albedo * (mean - 1),
                1.0,
                tolerance + light.grazing * light.bounces,
                f"{reason}; {EACH}",
            ),
            near("spread of B", float(B.std() / B.mean()), 0.0, 0.03, "some patches have shot once more than others"),
        ]

    return claims


def faint_room(span: float) -> Claims:
    """As in the bright room but for the lamps' ratio."""

    def claims(light: Light, _: Light) -> list[Claim]:
        ratios = [light.mean(light.on(f"faint {f}")) / light.mean(light.on(f"bright {f}")) / span for f in FACES]
        if light.way.projection == "stereographic":
            return [dark("faint over bright room", max(ratios) * span, span + 2 / light.map**2, RIM)]
        return [
            near(f"faint over bright room, as their lamps, {w.__name__}", w(ratios), 1.0, 0.01, ORDER)
            for w in (min, max)
        ]

    return claims


def like_a_point(light: Light, _: Light) -> list[Claim]:
    floor = light.on("bottom")
    offset = light.position[floor] - [0.5, 0.5, 0.5]
    flux = BRIGHT * scenes.LAMP_SHARE * 6
    truth = flux * 0.5**2 / (np.pi * (offset**2).sum(1) ** 2)
    error = light.H[floor] / truth - 1
    return [near("floor, RMS of H over Φ cosθ cosθ'/(π r²) - 1", float(np.sqrt((error**2).mean())), 0.0, 0.005, LAMP)]


def plates(degrees: float) -> Claims:
    """Between plates of 1 m² at an angle: Lambert's closed form at points of the dark one that crowd towards the hinge. For
    plates without end along the hinge F = 1 - sin(θ/2), the crossed strings' rule; of these, light leaves at both ends."""

    def claims(light: Light, _: Light) -> list[Claim]:
        edges, angle = np.linspace(0, 1, 401) ** 2, np.radians(degrees)
        away, z = (edges[1:] + edges[:-1]) / 2, (np.arange(40) + 0.5) / 40
        points = np.stack(np.broadcast_arrays(away[:, None] * np.cos(angle), away[:, None] * np.sin(angle), z), -1)
        normals = np.broadcast_to([np.sin(angle), -np.cos(angle), 0.0], points.shape)
        F = float((point_to_polygon(points, normals, light.scene.positions[:4]).mean(1) * np.diff(edges)).sum())
        endless = Claim("F of the plates / of endless ones", F / (1 - np.sin(angle / 2)), 1.0, 0.6, 1e-3, ENDS)
        return [near("light received / F", light.flux(light.on("plate")) / F, 1.0, 0.05, HINGE), endless]

    return claims


def through_slit(light: Light, _: Light) -> list[Claim]:
    heights, n = (np.arange(200) + 0.5) / 200, np.array([-1.0, 0.0, 0.0])
    points = np.stack([np.ones(200), heights, np.full(200, 0.5)], 1)
    lamp = np.array([[0, 0, 0], [0, 1, 0], [0, 1, 1], [0, 0, 1.0]])
    share = float(point_to_polygon(points, np.broadcast_to(n, points.shape), lamp).mean()) * scenes.SLIT
    return [Claim("light through the slit / closed form", light.flux(behind(light)) / share, 1.0, 1.0, 20.0, MISSED)]


def behind(light: Light) -> NDArray[np.bool_]:
    """(n,) texels of the second room."""
    return (light.position[:, 0] > 1 + 1e-6) | (light.on("between") & (light.normal[:, 0] > 0))


def shut(light: Light, _: Light) -> list[Claim]:
    return [dark("light behind the wall / emitted", light.flux(behind(light)), light.grazing, GRAZING)]


# -- the same as a clean scene -----------------------------------------------------------------------------------------


def as_twin(tolerance: float, reason: str, *names: str) -> Claims:
    def claims(light: Light, twin: Light) -> list[Claim]:
        shown = names or [n for n in twin.scene.objects if twin.mean(twin.on(n)) > 0 and n != "lamp"]
        ratios = {n: light.mean(light.on(n)) / twin.mean(twin.on(n)) for n in shown}
        worst = max(ratios, key=lambda n: abs(ratios[n] - 1))
        return [
            near(
                f"mean H over that of the clean scene, worst ({worst})",
                ratios[worst],
                1.0,
                tolerance + light.grazing * light.bounces,
                f"{reason}; {EACH}",
            )
        ]

    return claims


def tight(light: Light, twin: Light) -> list[Claim]:
    rim = 2 / light.map**2 * light.bounces if light.way.projection == "stereographic" else 0.0
    leaves = dark(
        "light that leaves / emitted", light.share("escaped"), 1e-4 + rim, f"{CRACKS}; {RIM}" if rim else CRACKS
    )
    return [*as_twin(0.01, SAME)(light, twin), leaves]


def near_ceiling(light: Light, twin: Light) -> list[Claim]:
    over = light.on("top") & (np.abs(light.position[:, [0, 2]] - 0.5).max(1) < 0.125)
    return [
        *as_twin(0.01, SAME, *[f for f in FACES if f != "top"])(light, twin),
        dark("ceiling over the lamp / its mean", float(light.H[over].max()) / light.mean(light.on("top")), 0.03, EDGE),
    ]


# -- darkness ----------------------------------------------------------------------------------------------------------


def under_boxes(light: Light, _: Light) -> list[Claim]:
    claims, mean = [], light.mean(light.on("bottom"))
    for name, middle in {"stands": (0.75, 1.5), "touches": (0.25, 0.5), "pierces": (1.5, 0.75)}.items():
        inside = np.abs(light.position[:, [0, 2]] - middle).max(1) < 0.25 - 1 / 16
        floor, bottom = (
            inside & light.on("bottom"),
            light.on(name) & (light.position[:, 1] < 1e-6) & (light.normal[:, 1] < -0.5),
        )
        claims.append(dark(f"floor under what {name} / floor", light.mean(floor) / mean, light.grazing, GRAZING))
        claims.append(dark(f"bottom of what {name} / floor", light.mean(bottom) / mean, light.grazing, GRAZING))
    return claims


def one_room_lit(light: Light, _: Light) -> list[Claim]:
    x, nx = light.position[:, 0], light.normal[:, 0]
    left = (x < 1 - 1e-6) | (light.on("sheet") & (nx < 0))
    right = (x > 2 + scenes.THICKNESS / 4) & ~(light.on("slab") & (nx < 0))
    return [
        dark(f"light behind the {what} / emitted", light.flux(there), light.grazing, GRAZING)
        for what, there in (("sheet", left), ("slab", right))
    ]


def ever_darker(light: Light, _: Light) -> list[Claim]:
    cells = [light.mean(light.on("bottom") & (np.floor(light.position[:, 0]) == i)) for i in range(5)]
    steps = [b / a if a > 0 else 0.0 for a, b in itertools.pairwise(cells[:4])]
    return [
        Claim(
            "floor of a cell / of that before, most",
            max(steps),
            0.0,
            0.0,
            1.0,
            "doors let a quarter through",
            exact=False,
        ),
        Claim(
            "floor of a cell / of that before, least",
            min(steps),
            1.0,
            1.0 - 1e-4,
            0.0,
            "there is light behind each open door",
        ),
        dark("floor behind the shut door / first floor", cells[4] / cells[0], light.grazing, GRAZING),
    ]


# -- the table ---------------------------------------------------------------------------------------------------------

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
        as_twin(0.01, SAME),
        twin=PLAIN,
        scale=factor,
        ways=SOLVERS_ONLY,
        book=0.02,
        book_reason=PAST,
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
        residual=(0.8, 0.01),
    ),
    HardCase(
        "furnace-0.999",
        "a closed room that reflects 99.9 % and glows",
        of(lambda: scenes.furnace(0.999)),
        glows(0.999, 0.01),
        density=(4, 8),
        map=(128, 256),
        residual=(0.97, 0.5),
        ways=tuple(way for way in WAYS if way.projection == "hemicube"),
    ),
    HardCase(
        "bright-and-faint",
        "two closed rooms, one lit by 10⁶ W/m², the other by 10⁻⁶",
        of(lambda: scenes.bright_and_faint(1e6, 1e-6)),
        faint_room(1e-12),
        density=(4, 16),
        map=(256, 256),
        residual=(1e-18, 1e-18),
        ways=tuple(way for way in WAYS if way.solver == DEFAULT_SOLVER),
    ),
    HardCase(
        "bright-and-dim",
        "the same, the other by 10 W/m²: quadtrees are converged at 10⁻⁹ of all light",
        of(lambda: scenes.bright_and_faint(1e6, 10.0)),
        faint_room(1e-5),
        density=(4, 16),
        map=(256, 256),
        residual=(LEAST, LEAST),
        ways=tuple(way for way in WAYS if way.solver != DEFAULT_SOLVER),
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
        twin=of(lambda: scenes.lamp_near_ceiling(0.0)),
    ),
    HardCase(
        "boxes-on-floor",
        "boxes that stand on a floor, touch a wall, and pierce the floor",
        of(scenes.boxes_on_floor),
        under_boxes,
        book=0.02,
        book_reason=STANDING,
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
        as_twin(0.01, SAME),
        twin=PLAIN,
        book=0.02,
        book_reason=PAST,
        ways=SOLVERS_ONLY,
    ),
    HardCase(
        "degenerate-duplicate",
        "triangles without area, floor and table twice",
        of(scenes.spoiled),
        as_twin(0.01, SAME),
        twin=PLAIN,
        book=0.02,
        book_reason=PAST,
        ways=SOLVERS_ONLY,
    ),
    HardCase(
        "winding",
        "double-sided walls, every other triangle wound the other way",
        of(lambda: scenes.double_sided(True)),
        as_twin(0.03, HALVES),
        density=(16, 32),
        book=0.02,
        book_reason=HALVES,
        twin=of(lambda: scenes.double_sided(False)),
        ways=SOLVERS_ONLY,
    ),
    HardCase(
        "t-junctions",
        "floor tiles whose corners lie within their neighbours' edges, turned",
        of(scenes.t_junctions),
        tight,
        twin=of(lambda: scenes.turned(scenes.furnished())),
        book=0.02,
        book_reason=PAST,
    ),
    HardCase(
        "far-away",
        "a furnished room millions of metres from the origin",
        of(lambda: scenes.transformed(scenes.furnished(), AWAY)),
        as_twin(0.01, SAME),
        twin=PLAIN,
        book=0.02,
        book_reason=PAST,
        ways=SOLVERS_ONLY,
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
        book=0.03,
        book_reason=FACETS,
    ),
    HardCase(
        "many-shots",
        "1000 shots (large: 100 000) in a room that reflects 99.9 %",
        of(lambda: scenes.furnace(0.999)),
        glows(0.999, 0.01),
        density=(4, 4),
        map=(64, 64),
        shots=(1000, 100_000),
        ways=(Way(), Way(storage="rgba16f")),
    ),
    *map(_corner, ANGLES),
)
