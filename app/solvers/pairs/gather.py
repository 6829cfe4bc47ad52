"""Gathering sums up what some texels receive from some senders: by looking from texel to sender, by what senders see, or along
directions. Each is a row of ``gather_of``, in which one pass draws one part of a bounce."""

from __future__ import annotations

from typing import Protocol

from app.gpu import Framebuffer, Gpu, Pass, Texture
from app.lightmap.lightmap import Lightmap
from app.solvers.pairs.kept import KeptPairs
from app.solvers.pairs.occlusion import Occlusion, Scenes
from app.solvers.pairs.options import PairsOptions
from app.solvers.pairs.senders import Senders
from app.visibility.occluders import occluders_of
from app.visibility.projections import PROJECTIONS

CHOICES = {"monte-carlo": 1, "quadtree": 2}  # of CHOICE in gather.frag.glsl, else 0
# Edge of a full face of a sender's map [px]: a texel of a lightmap of 128² is no smaller there than a sample, half the scene away
MAP = 256
MAPS = 10  # drawn above each other
OPEN = 0.0  # of an item, see common/item.glsl
Area = tuple[int, int, int, int]
# Of one draw. Mesa's llvmpipe ends the loops of a fragment after 65,536 rounds of all of them, inner ones too: a way through
# voxels takes up to 3·128, a ray some hundred.
AT_ONCE = 128


class Gather(Protocol):
    """choices: what each texel gathers from: senders, windows or directions. most: of them at once. whole: whether a part is to
    be of all texels, since what it prepares serves all of them."""

    choices: int
    most: int
    whole: bool

    def draw(
        self, target: Framebuffer, sent: dict[str, Texture], area: Area, first: int, count: int, bounce: int
    ) -> None:
        """Add what the texels of an area receive from ``count`` choices. sent: t_sent, t_place, t_facing."""

    def release(self) -> None: ...


class PairGather:
    """From texel to sender, see gather.frag.glsl."""

    whole = False

    def __init__(
        self, gpu: Gpu, lightmap: Lightmap, senders: Senders, options: PairsOptions, occlusion: Occlusion
    ) -> None:
        self._lightmap, self._senders, self._occlusion = lightmap, senders, occlusion
        self._choice = CHOICES.get(options.senders, 0)
        table = senders.table
        self.choices = len(table.windows) if self._choice == 1 else table.senders
        self.most = min(self.choices, AT_ONCE)
        self._pass = Pass(
            gpu,
            "solvers/pairs/gather",
            defines={"CHOICE": self._choice} | lightmap.defines("MATERIAL_BITS") | occlusion.defines,
            slots={"occlusion": occlusion.glsl},
        )

    def draw(
        self, target: Framebuffer, sent: dict[str, Texture], area: Area, first: int, count: int, bounce: int
    ) -> None:
        textures = sent | self._senders.some("t_number") | self._occlusion.textures
        uniforms = {"u_range": (first, count)} | self._occlusion.uniforms
        if self._choice == 1:
            textures |= self._senders.some("t_windows")
            uniforms["u_pass"] = bounce
        surfaces = self._lightmap.textures("t_position_area", "t_normal_ids", "t_facets")
        self._pass.draw(target, textures=textures | surfaces, uniforms=uniforms, viewport=area, blend="add")

    def release(self) -> None:
        pass


class MapGather:
    """By what senders see: a hemicube each, in which texels look themselves up [Cohen85]. Triangles between its samples cast no
    shadow."""

    whole = True

    def __init__(self, gpu: Gpu, lightmap: Lightmap, senders: Senders) -> None:
        self._gpu, self._lightmap = gpu, lightmap
        self._projection = PROJECTIONS["hemicube"]
        self.choices, self.most = senders.table.senders, MAPS
        self._occluders = occluders_of(gpu, lightmap)
        width, height = self._projection.size(MAP)
        self._items = gpu.texture((width, height * MAPS), 1, "f4")
        self._depth = gpu.depth_texture(self._items.size)
        self._maps = gpu.target(self._items, depth=self._depth)
        bits, pixels = lightmap.defines("MATERIAL_BITS"), {"RESOLUTION": MAP}
        self._see = {
            some.sheer: Pass(
                gpu,
                "solvers/pairs/map",
                defines=bits | pixels | {"VIEWS": self._projection.views} | ({"OPACITY": True} if some.sheer else {}),
                slots=self._projection.drawing,
            )
            for some in self._occluders
        }
        self._gather = Pass(
            gpu, "solvers/pairs/gather_maps", defines=bits | pixels, slots={"projection": self._projection.glsl}
        )

    def draw(
        self, target: Framebuffer, sent: dict[str, Texture], area: Area, first: int, count: int, bounce: int
    ) -> None:
        self._maps.clear(OPEN, depth=1.0)
        for some in self._occluders:
            casters = self._projection.casters(some, MAP)
            self._see[some.sheer].draw(
                self._maps,
                textures=casters.textures | {n: sent[n] for n in ("t_place", "t_facing")},
                uniforms={"u_first": first, "u_maps": MAPS} | casters.uniforms,
                mesh=casters.mesh,
                vertices=casters.vertices,
                instances=self._projection.views * count,
                depth=True,
                clip_distances=self._projection.clip_distances,
            )
        surfaces = self._lightmap.textures("t_position_area", "t_normal_ids", "t_facets")
        self._gather.draw(
            target,
            textures=sent | surfaces | {"t_items": self._items, "t_depth": self._depth},
            uniforms={"u_range": (first, count)},
            viewport=area,
            blend="add",
        )

    def release(self) -> None:
        for some in self._occluders:
            some.release()
        self._gpu.release_all(self._maps, self._items, self._depth)


class DirectionGather:
    """Along directions, see directions.frag.glsl."""

    whole = False

    def __init__(self, gpu: Gpu, lightmap: Lightmap, senders: Senders, scenes: Scenes, directions: int) -> None:
        self._lightmap, self._senders, self._scenes = lightmap, senders, scenes
        self.choices, self.most = directions, min(directions, AT_ONCE)
        defines = lightmap.defines("MATERIAL_BITS", "TILE") | scenes.rays.defines
        self._pass = Pass(gpu, "solvers/pairs/directions", defines=defines)

    def draw(
        self, target: Framebuffer, sent: dict[str, Texture], area: Area, first: int, count: int, bounce: int
    ) -> None:
        lightmap = self._lightmap
        self._pass.draw(
            target,
            textures=lightmap.textures("t_position_area", "t_normal_ids", "t_pages", "t_leaves")
            | self._senders.some("t_number")
            | self._scenes.rays.textures
            | {"t_sent": sent["t_sent"]},
            uniforms={
                "u_range": (first, count),
                "u_directions": self.choices,
                "u_pages": (float(lightmap.columns), lightmap.pool.pages_per_texel),
            },
            viewport=area,
            blend="add",
        )

    def release(self) -> None:
        pass


def gather_of(
    gpu: Gpu, lightmap: Lightmap, senders: Senders, scenes: Scenes, options: PairsOptions
) -> tuple[Gather, KeptPairs | None]:
    """As the options ask for it, and what it keeps of pairs."""
    if options.senders == "directional":
        return DirectionGather(gpu, lightmap, senders, scenes, options.directions), None
    if options.occlusion == "hemicube":
        return MapGather(gpu, lightmap, senders), None
    occlusion = scenes.occlusion(options.occlusion, options.voxels)
    kept = KeptPairs(gpu, lightmap, senders, occlusion) if options.keep_pairs else None
    return PairGather(gpu, lightmap, senders, options, kept.occlusion if kept else occlusion), kept
