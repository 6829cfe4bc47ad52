"""Spectra and colour temperatures as linear Rec.709: matching functions, black bodies, how many kelvin a colour has, and how many
lumen a watt is.

Here a watt is 683 lm wherever light is read, made, shown or written: of linear Rec.709 the luminance Y = ∫ ȳ L dλ is in watts as
the eye weighs them, and 683 lm/W is what the SI counts those by. glTF's files have lights in candela and lux, which Blender
writes by that number, too. RADIANCE counts 179 lm for a watt of all wavelengths of white light [Ward94] instead.
"""

from __future__ import annotations

import functools

import numpy as np

F64 = np.ndarray[tuple[int, ...], np.dtype[np.float64]]
RGB = tuple[float, float, float]

LUMENS_PER_WATT = 683.0  # K_cd, at 555 nm, where ȳ is 1 [SI brochure, 9th edition, 2.3.1]
REC709_FROM_XYZ = np.array(  # ITU-R BT.709-6, white D65
    [[3.2404542, -1.5371385, -0.4985314], [-0.9692660, 1.8760108, 0.0415560], [0.0556434, -0.2040259, 1.0572252]]
)
NM = np.arange(380.0, 781.0, 5.0)  # wavelengths that spectra are summed up at
STEP = 5e-9  # m, between them
COOLEST, HOTTEST = 2000.0, 12000.0  # K, of lamps and skies; the colour of a cooler body is outside of Rec.709
FARTHEST = 0.05  # from a black body in CIE 1960 (u, v), beyond which a colour has no temperature [CIE 15:2004]


def black_body(kelvin: float) -> F64:
    """Spectral radiance at NM [W/(sr m³)], by Planck's law."""
    metres = NM * 1e-9
    return np.asarray(1.191043e-16 / metres**5 / np.expm1(1.438777e-2 / (metres * kelvin)))


def matching() -> F64:
    """(3, n) x̄, ȳ, z̄ of CIE 1931 at NM, fitted by lobes [Wyman13]."""

    def lobe(height: float, middle: float, below: float, above: float) -> F64:
        return np.asarray(height * np.exp(-0.5 * ((NM - middle) / np.where(NM < middle, below, above)) ** 2))

    return np.stack(
        [
            lobe(1.056, 599.8, 37.9, 31.0) + lobe(0.362, 442.0, 16.0, 26.7) + lobe(-0.065, 501.1, 20.4, 26.2),
            lobe(0.821, 568.8, 46.9, 40.5) + lobe(0.286, 530.9, 16.3, 31.1),
            lobe(1.217, 437.0, 11.8, 36.0) + lobe(0.681, 459.0, 26.0, 13.8),
        ]
    )


def colour_of_kelvin(kelvin: float) -> RGB:
    """Linear Rec.709 of a black body, its largest channel 1; what is outside of the gamut is cut off."""
    rgb = np.maximum(REC709_FROM_XYZ @ _black_body_XYZ(kelvin), 0.0)
    red, green, blue = (rgb / rgb.max()).tolist()
    return red, green, blue


def kelvin_of_colour(colour: RGB) -> float | None:
    """The correlated colour temperature of linear Rec.709, of the black body that is nearest, by the parabola of [Ohno14]; None
    for black, and for what no black body looks like."""
    XYZ = np.linalg.solve(REC709_FROM_XYZ, np.array(colour, np.float64))
    if XYZ.sum() <= 0:
        return None
    kelvin, locus = _locus()
    off = np.linalg.norm(locus - _uv(XYZ), axis=1)
    nearest = int(off.argmin())
    if off[nearest] > FARTHEST or not 0 < nearest < len(kelvin) - 1:
        return None
    around = slice(nearest - 1, nearest + 2)
    bend, slope, _ = np.polyfit(kelvin[around] - kelvin[nearest], off[around], 2)
    return float(kelvin[nearest] - slope / (2 * bend))


@functools.cache
def _locus() -> tuple[F64, F64]:
    """Temperatures (n,), a hundredth apart, and what their black bodies have in CIE 1960 (n, 2)."""
    kelvin = COOLEST * 1.01 ** np.arange(-1, np.log(HOTTEST / COOLEST) / np.log(1.01) + 2)
    return np.asarray(kelvin), np.stack([_uv(_black_body_XYZ(k)) for k in kelvin.tolist()])


def _black_body_XYZ(kelvin: float) -> F64:
    return np.asarray(matching() @ black_body(kelvin))


def _uv(XYZ: F64) -> F64:
    """CIE 1960."""
    X, Y, Z = XYZ
    return np.asarray(np.array([4 * X, 6 * Y]) / (X + 15 * Y + 3 * Z))
