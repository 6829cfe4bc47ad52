"""What the papers measured on their machines: numbers to stand beside ours, none of them ours.

[Coombe03] G. Coombe, M. Harris, A. Lastra: Radiosity on Graphics Hardware, 2003. Table 1.
[Wallner10] G. Wallner: An Empirical Evaluation of a GPU Radiosity Solver, GRAPP 2010. Tables 1 and 2, figure 6.
[Kahl22] B. Kahl: Hardware Acceleration of Progressive Refinement Radiosity using Nvidia RTX, 2022. Conclusions.
[Shcherbakov19] A. Shcherbakov, V. Frolov: Implementation of the Radiosity Algorithm for Large Scale Scenes, GraphiCon 2019.
Figure 3.
"""

from __future__ import annotations

from dataclasses import dataclass

KAHL = "Kahl 2022, conclusions: no numbers"
COOMBE = "Coombe, Harris & Lastra 2003, table 1: NVIDIA GeForce FX"
WALLNER = "Wallner 2010, {}: Intel Core2 2.13 GHz, 3.5 GB, GeForce 8800 GTS 640 MB"

SHCHERBAKOV = (
    "Shcherbakov & Frolov 2019, figure 3: a Minecraft scene of 63,125 patches; the local matrix 2 ms and 128 MB, a matrix of "
    "all patches 300 ms (estimated) and 30 GB, pictures that differ by less than 0.05 on average; of figure 4 we have no numbers"
)


@dataclass(frozen=True)
class CoombeRow:
    """Texels, and seconds per shot, of uniform and adaptive subdivision."""

    scene: str
    uniform_texels: int
    adaptive_texels: int
    uniform_s: float
    adaptive_s: float


COOMBE_TABLE_1 = (
    CoombeRow("cornell-box", 31_000, 18_000, 0.25, 0.17),
    CoombeRow("museum", 172_000, 25_000, 1.1, 1.41),
    CoombeRow("grotto", 1_600_000, 225_000, 6.45, 10.27),
)


@dataclass(frozen=True)
class WallnerRow:
    """Iterations, triangles, radiosity elements, and seconds of the whole run by non-linear hemisphere and hemicube."""

    scene: str
    iterations: int
    triangles: int
    texels: int
    sphere_s: float
    cube_s: float


WALLNER_TABLE_1 = (
    WallnerRow("cbox low", 32, 258, 11_802, 0.79, 1.15),
    WallnerRow("cbox medium", 32, 258, 94_750, 0.75, 1.13),
    WallnerRow("cbox high", 32, 258, 1_115_126, 1.17, 1.48),
    WallnerRow("temple low", 24, 15_872, 126_078, 9.74, 12.58),
    WallnerRow("temple medium", 24, 15_872, 516_312, 9.92, 12.72),
    WallnerRow("temple high", 24, 15_872, 2_074_242, 10.03, 13.18),
    WallnerRow("office low", 96, 21_704, 254_572, 18.46, 42.46),
    WallnerRow("office medium", 96, 21_704, 854_341, 18.03, 42.44),
    WallnerRow("office high", 96, 21_704, 1_843_771, 18.73, 43.03),
    WallnerRow("living low", 32, 38_147, 472_317, 20.18, 33.10),
    WallnerRow("living medium", 32, 38_147, 866_330, 20.05, 33.24),
    WallnerRow("living high", 32, 38_147, 1_612_067, 20.61, 33.45),
)


@dataclass(frozen=True)
class RmsRow:
    """RMS against the hemicube's lightmaps, Cornell box: subdivision, its level, texture edge [px], by both hemispheres."""

    subdivision: str
    level: int
    size: int
    stereographic: float
    nonlinear: float


WALLNER_TABLE_2 = (
    RmsRow("none", 0, 256, 0.001745, 0.000279),
    RmsRow("adaptive", 3, 32, 0.002047, 0.000953),
    RmsRow("regular", 3, 32, 0.000331, 0.000104),
    RmsRow("adaptive", 3, 64, 0.000789, 0.000397),
    RmsRow("regular", 3, 64, 0.000133, 0.000057),
    RmsRow("adaptive", 2, 32, 0.003907, 0.001434),
    RmsRow("regular", 2, 32, 0.001287, 0.000457),
    RmsRow("adaptive", 2, 64, 0.001726, 0.000576),
    RmsRow("regular", 2, 64, 0.000591, 0.000187),
)

WALLNER_FIGURE_6 = {"hemicube": 3514, "stereographic": 4106}  # shootings until converged, living room


@dataclass(frozen=True)
class MatrixRow:
    """A matrix of several reflections has so many patches, and takes milliseconds and megabytes. difference: of pixels of its
    picture is below this on average."""

    patches: int
    ms: float
    megabytes: float
    difference: float | None


SHCHERBAKOV_LOCAL = MatrixRow(4096, 2.0, 128.0, 0.05)
SHCHERBAKOV_WHOLE = MatrixRow(63_125, 300.0, 30_000.0, None)
