"""Irradiance at nodes, gathered along rays from the solution as it is, and what those rays meet; see shaders/estimate.

    H'(x) = ∫ B(y) cos θ dω / π        B = E + ρH of the texel that a ray meets; lamps are looked at, too

It knows neither the texels nor the patches that the light came by: B's own error, spread over all that x sees, is what is left.
A node is a point of the surfaces. Rows of a look each belong to one, with random shifts of its own.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from app.atlas.points import Points
from app.direct_light.punctual import light_rows
from app.direct_light.sky_map import sky_textures
from app.gpu import Gpu, Pass, ReadBack, Texture, glsl_constant
from app.lightmap.lightmap import Lightmap
from app.lightmap.textures import upload, write_table
from app.scene.model import F32, F64
from app.scene.sky import Sky
from app.visibility.rays import ENTRIES_A_ROW, RayScene, corners_of

RAYS = 512  # of a row, and as many to lamps
LINKS = 64  # rays of a row whose ends are told
CANDIDATES = 4  # nodes that may stand for such an end, see estimate/nearest_seen.frag.glsl
BLOCK = 32  # rays that are added up at once
SHIFTS = 5  # random numbers that a row needs
LAMPS_A_ROW = 1 << int(glsl_constant("estimate/gather.frag.glsl", "LAMP_BITS"))
SURFACE = "t_pages", "t_leaves", "t_normal_ids", "t_materials", "t_irradiance", "t_ambient", "t_albedo", "t_emission"


class Ends(NamedTuple):
    """Where links of nodes end: hit (n, LINKS) bool, points of all (n · LINKS), albedo (n, LINKS, 3), irradiance (n, LINKS):
    the mean of its colours [W/m²]."""

    hit: NDArray[np.bool_]
    points: Points
    albedo: F64
    irradiance: F64


class RayGather:
    """Looks from up to ``rows`` rows at once, into one lightmap and the sky that it has now. Whoever makes it releases it."""

    def __init__(self, gpu: Gpu, lightmap: Lightmap, rows: int) -> None:
        self._gpu, self._lightmap, self.rows = gpu, lightmap, rows
        self._rays = RayScene(gpu, lightmap.pool)
        self._slot = np.argsort(self._rays.bvh.order)  # of each triangle
        corners = corners_of(lightmap.pool)
        self._area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1) / 2
        self._textures = {
            "faces": upload(gpu, self._faces()),
            "nodes": gpu.texture((3, rows), 4, "f4"),
            "samples": gpu.texture((RAYS, rows), 4, "f4"),
            "sums": gpu.texture((RAYS // BLOCK, rows), 4, "f4"),
            "hits": gpu.texture((LINKS, rows), 4, "f4"),
            "albedo": gpu.texture((LINKS, rows), 4, "f4"),
            "candidates": gpu.texture((LINKS, rows), 4, "f4"),
            "seen": gpu.texture((LINKS, rows), 4, "f4"),
        }
        self._lamps, self._all_nodes = (gpu.texture((1, 1), 4, "f4") for _ in range(2))
        self._lamp_count, self._power = 0, 0.0
        self._targets = {n: gpu.target(self._textures[n]) for n in ("samples", "sums", "hits", "albedo", "seen")}
        self._link_target = gpu.target(self._textures["hits"], self._textures["albedo"])
        light = lightmap.defines("TILE", "MATERIAL_BITS", "ALBEDO_TEXTURE", "EMISSION_TEXTURE") | self._rays.defines
        self._links = Pass(gpu, "estimate/links", defines=light)
        self._light, self._gather = light, dict[tuple[bool, bool], Pass]()
        self._sky: tuple[Sky, dict[str, Texture]] | None = None
        self._lights = gpu.texture((1, 1), 4, "f4")  # see common/light.glsl
        self._light_count = 0
        self._add = Pass(gpu, "estimate/add", defines={"BLOCK": BLOCK})
        self._nearest = Pass(gpu, "estimate/nearest_seen", defines=self._rays.defines)

    def find_lamps(self) -> bool:
        """Use the lamps, with an area or without, and the sky of the scene as it is now. False where nothing sends light."""
        scene = self._lightmap.scene
        sky = scene.sky if scene.lit_by_sky else None
        self._find_sky(sky if sky is not None and sky.shines else None)
        lights = [light for light in scene.lights_and_sun if light.emits]
        self._light_count = len(lights)
        if lights:
            self._lights = write_table(self._gpu, self._lights, light_rows(lights, self._lightmap))
        power = np.array([np.mean(m.emission) for m in scene.materials])[scene.material_ids] * np.pi * self._area
        lamps = np.flatnonzero(power > 0)
        self._lamp_count, self._power = len(lamps), float(power.sum())
        table = np.zeros((max(1, -(-len(lamps) // LAMPS_A_ROW)) * LAMPS_A_ROW, 4), np.float32)
        table[: len(lamps), 0] = np.cumsum(power[lamps]) / max(self._power, 1e-300)
        table[: len(lamps), 1] = self._slot[lamps]
        self._lamps = write_table(self._gpu, self._lamps, table.reshape(-1, LAMPS_A_ROW, 4))
        return len(lamps) > 0 or scene.lit_by_sky or self._light_count > 0

    def _find_sky(self, sky: Sky | None) -> None:
        if self._sky is not None and self._sky[0] is not sky:
            self._gpu.release_all(*self._sky[1].values())
            self._sky = None
        if sky is not None and self._sky is None:
            self._sky = sky, sky_textures(self._gpu, sky)

    @property
    def _gathering(self) -> Pass:
        """The program for what there is now."""
        kind = self._sky is not None, self._light_count > 0
        if kind not in self._gather:
            more = dict(zip(("SKY", "LIGHTS"), kind, strict=True))
            self._gather[kind] = Pass(self._gpu, "estimate/gather", defines=self._light | more)
        return self._gather[kind]

    # -- light ---------------------------------------------------------------------------------------------------------

    def look(self, position: F64, normal: F64, shifts: F64, rays: int = RAYS) -> ReadBack:
        """What nodes receive now, on its way; ``irradiance`` reads it. position (n, 3) [m], normal (n, 3), shifts (n, SHIFTS)
        from 0 to 1; n at most ``rows``. rays: a multiple of BLOCK."""
        self._write_nodes(position, normal, shifts)
        self._lightmap.refresh_ambient(whole=False)
        more, values = dict[str, Texture](), dict[str, object]()
        if self._sky is not None:
            more, values = self._sky[1], {"u_sky": tuple(self._sky[0].scale.tolist())}
        if self._light_count:
            more = more | {"t_lights": self._lights}
            values = values | {"u_lights": self._light_count, "u_rays": rays}
        self._gathering.draw(
            self._targets["samples"],
            textures={"t_nodes": self._textures["nodes"], "t_lamps": self._lamps} | self._seen_textures() | more,
            uniforms={"u_lamps": self._lamp_count, "u_power": max(self._power, 1e-30)} | self._uniforms() | values,
            viewport=(0, 0, rays, len(position)),
        )
        self._add.draw(self._targets["sums"], textures={"t_samples": self._textures["samples"]})
        return ReadBack.of(self._gpu, self._targets["sums"])

    def irradiance(self, looked: ReadBack, count: int, rays: int = RAYS) -> F64:
        """(count, 4) [W/m²]: RGB, and of what comes from lamps without a bounce the mean of its colours. Waits if it has not
        arrived."""
        return np.asarray(self._read(looked)[:count, : rays // BLOCK].sum(1, dtype=np.float64) / rays)

    # -- links ---------------------------------------------------------------------------------------------------------

    def look_for_ends(self, position: F64, normal: F64, shifts: F64) -> tuple[ReadBack, ReadBack]:
        """Where rays of nodes end, on its way; ``ends`` reads it. See ``look``."""
        self._write_nodes(position, normal, shifts)
        self._links.draw(
            self._link_target,
            textures={"t_nodes": self._textures["nodes"]} | self._seen_textures(),
            uniforms=self._uniforms(),
            viewport=(0, 0, LINKS, len(position)),
        )
        return ReadBack.of(self._gpu, self._targets["hits"]), ReadBack.of(self._gpu, self._targets["albedo"])

    def ends(self, looked: tuple[ReadBack, ReadBack], count: int) -> Ends:
        """Of so many rows. Waits if they have not arrived."""
        hit, albedo = (self._read(one)[:count].astype(np.float64) for one in looked)
        triangle, *weights, front = hit.reshape(-1, 4).T
        first = 1.0 - weights[0] - weights[1]
        points = Points(np.maximum(triangle, 0).astype(np.int32), front == 0.0, np.stack([first, *weights], 1))
        return Ends(hit[..., 0] >= 0, points, albedo[..., :3], albedo[..., 3])

    def set_nodes(self, position: F64, normal: F64) -> None:
        """All that look, helpers last: position (n, 3) [m], normal (n, 3)."""
        table = np.zeros((2, len(position), 4), np.float32)
        table[0, :, :3], table[1, :, :3] = self._lightmap.space.local_from_world(position), normal
        self._all_nodes = write_table(self._gpu, self._all_nodes, table)

    def look_at_helpers(self, first: int, candidates: F32, helpers: int) -> ReadBack:
        """Which of the candidates (n, LINKS, CANDIDATES), -1 for none, nodes see first, from the node ``first`` on; ``seen``
        reads it. Candidates count from the first helper on, the node ``helpers``."""
        rows = np.zeros((self.rows, LINKS, CANDIDATES), np.float32)
        rows[: len(candidates)] = candidates
        self._textures["candidates"].write(rows.tobytes())
        textures = {name: texture for name, texture in self._rays.textures.items() if name != "t_bvh_uv"}
        self._nearest.draw(
            self._targets["seen"],
            textures=textures | {"t_all_nodes": self._all_nodes, "t_candidates": self._textures["candidates"]},
            uniforms={"u_first": first, "u_helpers": helpers},
            viewport=(0, 0, LINKS, len(candidates)),
        )
        return ReadBack.of(self._gpu, self._targets["seen"])

    def seen(self, looked: ReadBack, count: int) -> NDArray[np.int64]:
        """(count, LINKS) helpers, -1 for none. Waits if they have not arrived."""
        return self._read(looked)[:count, :, 0].astype(np.int64)

    def release(self) -> None:
        self._rays.release()
        if self._sky is not None:
            self._gpu.release_all(*self._sky[1].values())
        self._gpu.release_all(self._link_target, *self._targets.values())
        self._gpu.release_all(self._lamps, self._lights, self._all_nodes, *self._textures.values())

    def _faces(self) -> F32:
        """See surface.glsl."""
        order, scene = self._rays.bvh.order, self._lightmap.scene
        table = np.zeros((max(1, -(-len(order) // ENTRIES_A_ROW)) * ENTRIES_A_ROW, 4), np.float32)
        table[: len(order), 0], table[: len(order), 1] = scene.material_ids[order], scene.sides[order]
        return table.reshape(-1, ENTRIES_A_ROW, 4)

    def _write_nodes(self, position: F64, normal: F64, shifts: F64) -> None:
        rows = np.zeros((self.rows, 3, 4), np.float32)
        used = rows[: len(position)]
        used[:, 0, :3], used[:, 1, :3] = self._lightmap.space.local_from_world(position), normal
        used[:, :2, 3], used[:, 2, :3] = shifts[:, :2], shifts[:, 2:]
        self._textures["nodes"].write(rows.tobytes())

    def _seen_textures(self) -> dict[str, Texture]:
        return self._rays.textures | {"t_faces": self._textures["faces"]} | self._lightmap.textures(*SURFACE)

    def _uniforms(self) -> dict[str, object]:
        pool = self._lightmap.pool
        return {"u_unit": self._lightmap.unit, "u_pages": (float(pool.columns), pool.pages_per_texel)}

    def _read(self, looked: ReadBack) -> F32:
        return np.frombuffer(looked.take(), np.float32).reshape(self.rows, -1, 4)
