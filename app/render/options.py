"""What the picture shows and how it is developed: the display knobs of viewer and headless shot."""

from __future__ import annotations

from dataclasses import dataclass

from app.options import Options, option
from app.render.units import UNITS

LAYERS = (
    *("combined", "irradiance", "residual", "albedo", "charts", "leaves", "texels", "density", "error"),
    *("direct", "indirect", "rays", "expected-error", "local", "seams"),
)
TONE_MAPS = ("clamp", "reinhard", "aces", "agx", "neutral")
INTERPOLATIONS = ("nearest", "bilinear", "bicubic")
SHOWN = ("solution", "reference", "split")
FALSE_COLOURS = ("off", "illuminance", "luminance")  # lux, cd/m²


@dataclass(frozen=True)
class DisplayOptions(Options):
    layer: str = option(
        "combined",
        "what is shown: B, H, r, albedo, charts, quadtree levels, texels, their density, error or jumps at seams; where the "
        "solver has it direct or indirect light, rays per texel, the error that it expects, or the local set around the observer",
        choices=LAYERS,
        tip="What surfaces show: combined is the picture; irradiance the light that they receive, residual what is "
        "unshot, then materials, texels and quadtrees, errors, and parts of the light, as far as the solver has "
        "them",
    )
    show: str = option("solution", "whose light: the solution's, a reference's, or both side by side", choices=SHOWN)
    split: float = option(
        0.5, "share of the picture that is the solution's, where both are shown", minimum=0, maximum=1
    )
    exposure: float = option(
        0.0,
        "exposure; where not given, found from the light",
        unit="EV",
        minimum=-24,
        maximum=24,
        usual=(-8, 8),
        tip="How bright the picture is: one more is twice as bright. The light itself stays",
    )
    tone_map: str = option(
        "agx",
        "tone curve",
        choices=TONE_MAPS,
        tip="How bright light is brought to the screen: agx, aces, reinhard and neutral roll off softly, each in its "
        "colours; clamp cuts off at white, and is exact below",
        term="tone reproduction",
    )
    interpolation: str = option(
        "bilinear",
        "what is shown between the middles of texels",
        choices=INTERPOLATIONS,
        tip="Light between the middles of texels: nearest shows texels as they are; bilinear is fast; bicubic hides "
        "even few of them, and takes longer to draw",
        term="reconstruction",
    )
    grid: bool = option(
        False,
        "draw texels and tiles, in a quadtree each level in its colour",
        tip="Draws the edges of texels and tiles over the picture, in a quadtree each level in its colour",
    )
    last_shooter: bool = option(
        False, "mark the patch that shot last", tip="Marks the patch that shot last in the picture", term="shooter"
    )
    quantities: str = option(
        "photometric",
        "what light is counted in: lux, cd/m² and lumen, or watts",
        choices=UNITS,
        tip="What light is counted in, everywhere in the window: lux, candela and lumen, as people see it, or watts. A watt is "
        "683 lumen, as in glTF files, so that a lamp reads what its file says",
    )
    false_colour: str = option(
        "off",
        "false colour with a legend: lux or cd/m²",
        choices=FALSE_COLOURS,
        tip="Shows how much light there is by colours of a scale, with a legend: illuminance, what arrives, or "
        "luminance, what leaves",
    )
    false_colour_log: bool = option(
        True,
        "logarithmic false-colour scale",
        label="Logarithmic scale",
        tip="Each colour of the scale is so many times the one before, which shows dark and bright places at once; "
        "off, so much more",
    )
    false_colour_max: float = option(
        0.0,
        "top of the false-colour scale; 0 = found from the light",
        unit="as the scale",
        minimum=0,
        maximum=1e9,
        logarithmic=True,
        zero="auto",
        label="Top of the scale",
        tip="The end of the scale: what is above it has its last colour. Found from the light, unless it is given",
    )

    @property
    def plain(self) -> bool:
        """Whether the picture is shown and nothing else: where nothing emits light, it is flat."""
        return (self.layer, self.show, self.false_colour) == ("combined", "solution", "off") and not self.grid
