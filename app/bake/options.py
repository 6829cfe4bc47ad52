"""How a bake is written: the knobs of its files."""

from __future__ import annotations

from dataclasses import dataclass

from app.atlas.charts import GAP
from app.options import Options, option


@dataclass(frozen=True)
class BakeOptions(Options):
    padding: int = option(
        GAP,
        "empty texels between charts: 6 and 14 keep them apart in mip levels 1 and 2; more than 2 moves those of a file's layout",
        unit="texels",
        minimum=GAP,
        maximum=32,
    )
    max_size: int | None = option(
        None,
        "cut the lightmap into pages, irradiance-1.exr and so on, none of them wider or higher; unset: one",
        unit="texels",
        minimum=64,
        maximum=16384,
        tip="Cut the lightmap into pages that are at most so wide and high, for renderers that take no larger pictures",
        label="Pages up to",
    )
    exr_float: bool = option(
        False,
        "write 32-bit floats: three times the size, for what is computed on; half floats are right to 0.05 %",
        label="32-bit floats",
    )
    parts: bool = option(
        False,
        "write the light straight from lamps, sun and sky and that which came by reflections apart, too: "
        "irradiance-direct.exr and irradiance-indirect.exr, whose sum is irradiance.exr",
        tip="Write direct and indirect light apart, too: what comes straight from lamps, sun and sky, and what comes by "
        "reflections",
        label="Direct, indirect",
    )
    hdr: bool = option(
        False, "write the lightmap as irradiance.hdr, too (Radiance RGBE, right to 0.4 %)", label="Radiance .hdr"
    )
    rgbe_png: bool = option(
        False, "write the lightmap as irradiance.rgbe.png, too: RGBE in the channels of a PNG", label="RGBE in a PNG"
    )
    embed: bool = option(
        False,
        "write embedded.glb, too: light and albedo as one picture, exposed, which any viewer shows, without extensions",
        label="One lit GLB",
    )
    web: bool = option(
        False,
        "write index.html, too: a page that shows the bake without a network (needs the npm package three)",
        label="Web page",
    )
    three: str | None = option(
        None,
        "folder of the npm package three; unset: node_modules/three, here or in a folder above",
        tip="Folder of the npm package three, which the page is made with",
        label="Folder of three",
    )
    moz_lightmap: bool = option(
        False,
        "name the lightmap in scene.glb by MOZ_lightmap, too, which readers that parse all images may refuse",
        label="MOZ_lightmap",
    )
