"""Radiance of the clear sky, and irradiance from the sun, by where the sun stands and how hazy the air is [Preetham99].

The sky's luminance and chromaticity are those of the paper, table 2 and appendix A.2; the sun's light is a black body's of
5778 K, attenuated as in its appendix A.1 by molecules, aerosols and ozone. Luminance becomes radiance by the lumens of a watt
that all light is counted with, so that lux and cd/m² are as outdoors. Below the horizon lies a ground, diffuse, of albedo
GROUND, that sky and sun light. Works badly for a sun below about 5°, where the model was not fitted, and for turbidities outside
2 to 6; a high sun's sky is up to twice as bright as measured ones [Zotti07].
"""

from __future__ import annotations

import numpy as np

from app.scene.colorimetry import LUMENS_PER_WATT, NM, REC709_FROM_XYZ, STEP, black_body, matching

F64 = np.ndarray[tuple[int, ...], np.dtype[np.float64]]

GROUND = 0.2  # albedo: usual where nothing is known of the ground [Liu63]
SUN_KELVIN, SUN_STERADIANS = 5778.0, 6.72e-5  # effective temperature, IAU 2015; a disc of 0.53°
OZONE_CM = 0.35  # column of it [Preetham99, A.1]
LEVEL = 1e-3  # least cosine that is looked up beside the horizon, where the model divides by it
RINGS = 64  # of directions, whose mean is the irradiance of a smooth sky to 0.1 %

# A, B, C, D, E of luminance Y and of chromaticities x, y: linear in turbidity [Preetham99, table 2]
PEREZ = np.array(
    [
        [(0.1787, -1.4630), (-0.3554, 0.4275), (-0.0227, 5.3251), (0.1206, -2.5771), (-0.0670, 0.3703)],
        [(-0.0193, -0.2592), (-0.0665, 0.0008), (-0.0004, 0.2125), (-0.0641, -0.8989), (-0.0033, 0.0452)],
        [(-0.0167, -0.2608), (-0.0950, 0.0092), (-0.0079, 0.2102), (-0.0441, -1.6537), (-0.0109, 0.0529)],
    ]
)
# of x and y at the zenith: turbidity² , turbidity, 1 by the sun's angle from there, cubed, squared, itself, 1
ZENITH = np.array(
    [
        [
            (0.00166, -0.00375, 0.00209, 0.0),
            (-0.02903, 0.06377, -0.03202, 0.00394),
            (0.11693, -0.21196, 0.06052, 0.25886),
        ],
        [
            (0.00275, -0.00610, 0.00317, 0.0),
            (-0.04214, 0.08970, -0.04153, 0.00516),
            (0.15346, -0.26756, 0.06670, 0.26688),
        ],
    ]
)
# absorption of ozone by wavelength [nm, 1/cm] [Iqbal83, as in Preetham99]
OZONE_NM = (440, 445, 460, 480, 500, 520, 540, 560, 575, 590, 605, 620, 640, 660, 680, 700, 730, 780)
OZONE_ABSORPTION = (
    *(0.0, 0.003, 0.006, 0.014, 0.030, 0.048, 0.075, 0.103, 0.122),
    *(0.115, 0.130, 0.105, 0.079, 0.057, 0.036, 0.023, 0.010, 0.0),
)


def clear_sky(directions: F64, towards_sun: F64, turbidity: float) -> F64:
    """(…, 3) radiance [W/(sr m²)], linear Rec.709, from directions (…, 3), without the sun's disc; of the ground from below."""
    up = directions[..., 1]
    sky = _above(directions, towards_sun, turbidity)
    height = float(np.degrees(np.arcsin(np.clip(towards_sun[1], -1, 1))))
    level = _irradiance(towards_sun, turbidity) + sun_irradiance(height, turbidity) * max(float(towards_sun[1]), 0.0)
    return np.asarray(np.where((up >= 0)[..., None], sky, GROUND / np.pi * level))


def _above(directions: F64, towards_sun: F64, turbidity: float) -> F64:
    """(…, 3) radiance above the horizon; what lies below is as at the horizon."""
    cosine = np.maximum(directions[..., 1], LEVEL)
    gamma = np.arccos(np.clip(directions @ towards_sun, -1, 1))
    theta_sun = float(np.arccos(np.clip(towards_sun[1], 0.0, 1.0)))
    chi = (4 / 9 - turbidity / 120) * (np.pi - 2 * theta_sun)
    luminance = (4.0453 * turbidity - 4.9710) * np.tan(chi) - 0.2155 * turbidity + 2.4192  # kcd/m²
    powers = np.array([theta_sun**3, theta_sun**2, theta_sun, 1.0])
    zenith = [luminance, *(np.array([turbidity**2, turbidity, 1.0]) @ ZENITH @ powers)]
    Y, x, y = (
        at_zenith * _perez(p, cosine, gamma) / _perez(p, 1.0, theta_sun)
        for at_zenith, p in zip(zenith, PEREZ @ [turbidity, 1.0], strict=True)
    )
    XYZ = np.stack([x / y * Y, Y, (1 - x - y) / y * Y], axis=-1) * (1000 / LUMENS_PER_WATT)
    return np.asarray(np.maximum(XYZ @ REC709_FROM_XYZ.T, 0.0))


def _perez(p: F64, cosine: F64 | float, gamma: F64 | float) -> F64:
    """F(θ, γ) [Perez93]."""
    A, B, C, D, E = p
    return np.asarray((1 + A * np.exp(B / cosine)) * (1 + C * np.exp(D * gamma) + E * np.cos(gamma) ** 2))


def _irradiance(towards_sun: F64, turbidity: float) -> F64:
    """(3,) of the sky on level ground [W/m²]: directions spread as the cosine."""
    sine = np.sqrt((np.arange(RINGS)[:, None] + 0.5) / RINGS)
    azimuth = (np.arange(2 * RINGS) + 0.5) / RINGS * np.pi
    up = np.broadcast_to(np.sqrt(1 - sine**2), (RINGS, 2 * RINGS))
    around = np.stack([sine * np.sin(azimuth), up, -sine * np.cos(azimuth)], axis=-1)
    return np.asarray(np.pi * _above(around, towards_sun, turbidity).mean((0, 1)))


def sun_irradiance(height: float, turbidity: float) -> F64:
    """(3,) on a surface that faces the sun at so many degrees above the horizon [W/m²], linear Rec.709; 0 below it."""
    if height <= 0:
        return np.zeros(3)
    um = NM / 1000
    air_mass = 1 / (np.sin(np.radians(height)) + 0.15 * (3.885 + height) ** -1.253)
    aerosols = 0.04608 * turbidity - 0.04586  # Ångström's β
    ozone = np.interp(NM, OZONE_NM, OZONE_ABSORPTION) * OZONE_CM
    depth = 0.008735 * um**-4.08 + aerosols * um**-1.3 + ozone
    E = black_body(SUN_KELVIN) * SUN_STERADIANS * np.exp(-air_mass * depth)
    XYZ = matching() @ E * STEP
    return np.asarray(np.maximum(REC709_FROM_XYZ @ XYZ, 0.0))
