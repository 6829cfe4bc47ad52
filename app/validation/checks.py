"""The checks of a hard case's light: a closed form, the answer of a clean scene beside it (its control), darkness, or an
order of brightness, each with the reason why it may be off.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from app.reference.form_factors import point_to_polygon
from app.scene.shapes import FACES
from app.validation import scenes
from app.validation.case import EACH, Check, Solution, dark, near

Checks = Callable[[Solution, Solution], list[Check]]

BRIGHT = 1e6  # W/m²
SUMS = "form factors of a shooter sum to 1 within 0.5 %, on average far better, and errors repeat at each bounce"
ORDER = "the rooms are alike, shots come in another order; 32-bit floats hold 10^-38"
RIM = "the rim of a map drawn in straight pieces is open by a sample or two, 1/R² each: a limit of this projection"
LAMP = "a lamp of one texel lies at that texel's centroid, sampled within its width"
HINGE = "next to the hinge light changes within a texel; at 179° all sight is within two samples of the plane"
ENDS = "light leaves at the ends of plates that are as long as wide"
MISSED = "a slit far narrower than a pixel of the map is missed, or counts as some pixels: a limit of visibility maps"
FEW = "few rays find the slit: four standard deviations, at most, of what texels say of it independently, Z = 4"
CRACKS = (
    "where an edge ends within another's, rounding may open single samples of the map, also to light that is taken back"
)
EDGE = "a texel that a surface cuts is lit or dark by its centroid"
GRAZING = "sight within two samples, 4/R, of a receiver's own plane may pass what stands on it: (4/R)² of its sky"
SAME = "which of two equal patches shoots first is chance, and as much as the residual is still unshot"


# -- closed forms ------------------------------------------------------------------------------------------------------


def glows(albedo: float, tolerance: float, reason: str = SUMS, *, grazes: bool = True) -> Checks:
    """B = E / (1 - ρ), here of E = 1. What is unshot makes as much more, at every moment: H = (E - r) / (1 - ρ) on average."""

    def checks(light: Solution, _: Solution) -> list[Check]:
        mean = light.mean(light.area > 0) * (1 - albedo) + light.share("unshot")
        B = 1.0 + albedo * light.H
        lost, why = (light.grazing * light.bounces, f"{reason}; {EACH}") if grazes else (0.0, reason)
        return [
            near(
                "mean B, once all is shot, x (1 - ρ) / E",
                1 + albedo * (mean - 1),
                1.0,
                tolerance + lost,
                why,
            ),
            near("spread of B", float(B.std() / B.mean()), 0.0, 0.03, "some patches have shot once more than others"),
        ]

    return checks


def faint_room(span: float) -> Checks:
    """As in the bright room but for the lamps' ratio."""

    def checks(light: Solution, _: Solution) -> list[Check]:
        ratios = [light.mean(light.on(f"faint {f}")) / light.mean(light.on(f"bright {f}")) / span for f in FACES]
        if light.method.projection == "stereographic":
            return [dark("faint over bright room", max(ratios) * span, span + 2 * light.sample, RIM)]
        return [
            near(f"faint over bright room, as their lamps, {w.__name__}", w(ratios), 1.0, 0.01, ORDER)
            for w in (min, max)
        ]

    return checks


def like_a_point(light: Solution, _: Solution) -> list[Check]:
    floor = light.on("bottom")
    flux = BRIGHT * scenes.LAMP_SHARE * 6
    # what is gathered is the mean over a texel, by two Gauss points along each edge; what is shot arrives at its middle
    middle, edge = light.position[floor] - [0.5, 0.5, 0.5], np.sqrt(light.area[floor])[:, None]
    places = (-1, 1) if light.method.projection is None else (0,)
    truth = np.zeros(len(middle))
    for i, j in itertools.product(places, places):
        offset = middle + edge * np.array([i, 0.0, j]) / 12**0.5
        truth += flux * 0.5**2 / (np.pi * (offset**2).sum(1) ** 2) / len(places) ** 2
    error = light.H[floor] / truth - 1
    return [near("floor, RMS of H over Φ cosθ cosθ'/(π r²) - 1", float(np.sqrt((error**2).mean())), 0.0, 0.005, LAMP)]


def plates(degrees: float) -> Checks:
    """Between plates of 1 m² at an angle: Lambert's closed form at points of the dark one that crowd towards the hinge. For
    plates without end along the hinge F = 1 - sin(θ/2), the crossed strings' rule; of these, light leaves at both ends."""

    def checks(light: Solution, _: Solution) -> list[Check]:
        edges, angle = np.linspace(0, 1, 401) ** 2, np.radians(degrees)
        away, z = (edges[1:] + edges[:-1]) / 2, (np.arange(40) + 0.5) / 40
        points = np.stack(np.broadcast_arrays(away[:, None] * np.cos(angle), away[:, None] * np.sin(angle), z), -1)
        normals = np.broadcast_to([np.sin(angle), -np.cos(angle), 0.0], points.shape)
        F = float((point_to_polygon(points, normals, light.scene.positions[:4]).mean(1) * np.diff(edges)).sum())
        endless = Check("F of the plates / of endless ones", F / (1 - np.sin(angle / 2)), 1.0, 0.6, 1e-3, ENDS)
        return [near("light received / F", light.flux(light.on("plate")) / F, 1.0, 0.05, HINGE), endless]

    return checks


def through_slit(light: Solution, _: Solution) -> list[Check]:
    heights, n = (np.arange(200) + 0.5) / 200, np.array([-1.0, 0.0, 0.0])
    points = np.stack([np.ones(200), heights, np.full(200, 0.5)], 1)
    lamp = np.array([[0, 0, 0], [0, 1, 0], [0, 1, 1], [0, 0, 1.0]])
    share = float(point_to_polygon(points, np.broadcast_to(n, points.shape), lamp).mean()) * scenes.SLIT
    what, there = "light through the slit / closed form", behind(light)
    ratio = light.flux(there) / share
    if light.method.projection is None:
        # Var Σx <= Σ E[x²], of what each texel says by itself
        spread = float(np.sqrt(((light.H * light.area)[there] ** 2).sum())) / light.emitted / share
        return [near(what, ratio, 1.0, min(4 * spread, 0.5), FEW)]
    return [Check(what, ratio, 1.0, 1.0, 20.0, MISSED)]


def behind(light: Solution) -> NDArray[np.bool_]:
    """(n,) texels of the second room."""
    return (light.position[:, 0] > 1 + 1e-6) | (light.on("between") & (light.normal[:, 0] > 0))


def shut(light: Solution, _: Solution) -> list[Check]:
    return [dark("light behind the wall / emitted", light.flux(behind(light)), light.grazing, GRAZING)]


# -- the same as a clean scene -----------------------------------------------------------------------------------------


def like_control(tolerance: float, reason: str, *names: str) -> Checks:
    def checks(light: Solution, control: Solution) -> list[Check]:
        shown = names or [n for n in control.scene.objects if control.mean(control.on(n)) > 0 and n != "lamp"]
        ratios = {n: light.mean(light.on(n)) / control.mean(control.on(n)) for n in shown}
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

    return checks


def tight(light: Solution, control: Solution) -> list[Check]:
    rim = 2 * light.sample * light.bounces if light.method.projection == "stereographic" else 0.0
    most, reason = 1e-4 + rim, f"{CRACKS}; {RIM}" if rim else CRACKS
    leaves = Check("light that leaves / emitted", light.share("escaped"), 0.0, most, most, reason, exact=False)
    return [*like_control(0.01, SAME)(light, control), leaves]


def near_ceiling(light: Solution, control: Solution) -> list[Check]:
    over = light.on("top") & (np.abs(light.position[:, [0, 2]] - 0.5).max(1) < 0.125)
    return [
        *like_control(0.01, SAME, *[f for f in FACES if f != "top"])(light, control),
        dark(
            "ceiling over the lamp / its mean",
            float(light.H[over].max(initial=0.0)) / light.mean(light.on("top")),
            0.03,
            EDGE,
        ),
    ]


# -- darkness ----------------------------------------------------------------------------------------------------------


def under_boxes(light: Solution, _: Solution) -> list[Check]:
    checks, mean = [], light.mean(light.on("bottom"))
    for name, middle in {"stands": (0.75, 1.5), "touches": (0.25, 0.5), "pierces": (1.5, 0.75)}.items():
        inside = np.abs(light.position[:, [0, 2]] - middle).max(1) < 0.25 - 1 / 16
        floor, bottom = (
            inside & light.on("bottom"),
            light.on(name) & (light.position[:, 1] < 1e-6) & (light.normal[:, 1] < -0.5),
        )
        checks.append(dark(f"floor under what {name} / floor", light.mean(floor) / mean, light.grazing, GRAZING))
        checks.append(dark(f"bottom of what {name} / floor", light.mean(bottom) / mean, light.grazing, GRAZING))
    return checks


def one_room_lit(light: Solution, _: Solution) -> list[Check]:
    x, nx = light.position[:, 0], light.normal[:, 0]
    left = (x < 1 - 1e-6) | (light.on("sheet") & (nx < 0))
    right = (x > 2 + scenes.THICKNESS / 4) & ~(light.on("slab") & (nx < 0))
    return [
        dark(f"light behind the {what} / emitted", light.flux(there), light.grazing, GRAZING)
        for what, there in (("sheet", left), ("slab", right))
    ]


def ever_darker(light: Solution, _: Solution) -> list[Check]:
    cells = [light.mean(light.on("bottom") & (np.floor(light.position[:, 0]) == i)) for i in range(5)]
    steps = [b / a if a > 0 else 0.0 for a, b in itertools.pairwise(cells[:4])]
    return [
        Check(
            "floor of a cell / of that before, most",
            max(steps),
            0.0,
            0.0,
            1.0,
            "doors let a quarter through",
            exact=False,
        ),
        Check(
            "floor of a cell / of that before, least",
            min(steps),
            1.0,
            1.0 - 1e-4,
            0.0,
            "there is light behind each open door",
        ),
        dark("floor behind the shut door / first floor", cells[4] / cells[0], light.grazing, GRAZING),
    ]
