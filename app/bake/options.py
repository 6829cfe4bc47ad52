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
        tip="Empty texels between charts. From 6 on the first mip level of the lightmap does not mix the light of two charts, "
        "from 14 on the second; more than 2 moves the charts of a file that brought its own layout. More padding is a larger "
        "lightmap",
    )
    max_size: int | None = option(
        None,
        "cut the lightmap into pages, irradiance-1.exr and so on, none of them wider or higher; unset: one",
        unit="texels",
        minimum=64,
        maximum=16384,
        label="Pages up to",
        tip="Cuts the lightmap into pages that are at most so wide and high, for renderers that take no larger pictures; each is "
        "a file of its own",
    )
    exr_float: bool = option(
        False,
        "write 32-bit floats: three times the size, for what is computed on; half floats are right to 0.05 %",
        label="32-bit floats",
        tip="Writes the lightmap in 32-bit floats, for what is computed on: three times the size. Half floats, which it has "
        "otherwise, are right to 0.05 %",
    )
    parts: bool = option(
        False,
        "write the light straight from lamps, sun and sky and that which came by reflections apart, too: "
        "irradiance-direct.exr and irradiance-indirect.exr, whose sum is irradiance.exr",
        label="Direct, indirect",
        tip="Writes two more lightmaps, whose sum is the whole one: light straight from lamps, sun and sky, and light that came "
        "by reflections. An engine can then light the scene itself and take only the reflections",
    )
    hdr: bool = option(
        False,
        "write the lightmap as irradiance.hdr, too (Radiance RGBE, right to 0.4 %)",
        label="Radiance .hdr",
        tip="Writes the lightmap as irradiance.hdr, too, which older tools read. It is right to 0.4 %",
    )
    rgbe_png: bool = option(
        False,
        "write the lightmap as irradiance.rgbe.png, too: RGBE in the channels of a PNG",
        label="RGBE in a PNG",
        tip="Writes the lightmap as irradiance.rgbe.png, too, for renderers that load no floats: the fourth channel is the "
        "exponent of the other three, which a shader multiplies. It is right to 0.4 %",
    )
    embed: bool = option(
        False,
        "write embedded.glb, too: light and albedo as one picture, exposed, which any viewer shows, without extensions",
        label="One lit GLB",
        tip="Writes embedded.glb, too: light times albedo as one picture, with the exposure of the display, which any glTF "
        "viewer shows as it is. Its light can no longer be changed",
    )
    web: bool = option(
        False,
        "write index.html, too: a page that shows the bake without a network (needs the npm package three)",
        label="Web page",
        tip="Writes index.html, too: a page that shows the bake in a browser, without a network. It needs the npm package three "
        "in node_modules here or in a folder above",
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
        tip="Names the lightmap in scene.glb by the extension MOZ_lightmap, too, which Hubs and its kin read. Readers that parse "
        "all images of a file may refuse it, since an EXR is none that glTF knows",
    )
