"""What senders send is found anew before each bounce: B = E + ρH, and in a quadtree which texels are merged."""

from __future__ import annotations

from collections.abc import Iterator

from app.gpu import Framebuffer, Gpu, Pass, Texture
from app.lightmap.lightmap import Lightmap
from app.solvers.pairs.senders import ENTRIES_A_ROW, Senders

ROWS = 16  # of entries whose texels are merged at once: each looks at up to 4^level others, for every level


class Sent:
    """By one table of senders. Whoever makes it releases it."""

    def __init__(self, gpu: Gpu, lightmap: Lightmap, senders: Senders, *, merged: bool) -> None:
        """merged: into nodes of a quadtree, as large as the window."""
        self._gpu, self._lightmap, self._senders = gpu, lightmap, senders
        reads = lightmap.defines("MATERIAL_BITS", "ALBEDO_TEXTURE", "EMISSION_TEXTURE")
        self._send = Pass(gpu, "solvers/pairs/send", defines=reads)
        self._merge = Pass(gpu, "solvers/pairs/merge") if merged else None
        self._sent = gpu.texture(senders.sent_size, 4, "f4")
        self._target = gpu.target(self._sent)
        names = ("t_sent", "t_place", "t_facing") if merged else ()
        self._nodes: dict[str, Texture] = {name: gpu.texture(senders.sent_size, 4, "f4") for name in names}
        self._nodes_target: Framebuffer | None = gpu.target(*self._nodes.values()) if merged else None

    @property
    def textures(self) -> dict[str, Texture]:
        """t_sent, and where what sends it is: t_place, t_facing."""
        return self._nodes or {"t_sent": self._sent} | self._senders.some("t_place", "t_facing")

    def draw(self, received: Texture, mean: float, threshold: float) -> Iterator[None]:
        """Of texels that have received H, in parts. mean: B̄ over all surfaces [stored units]; threshold: see merge.frag.glsl."""
        lightmap, senders = self._lightmap, self._senders
        reads = "t_position_area", "t_normal_ids", "t_materials", "t_albedo", "t_emission"
        self._send.draw(
            self._target,
            textures=lightmap.textures(*reads) | senders.some("t_texels", "t_ranges") | {"t_received": received},
            uniforms={"u_senders": senders.table.senders, "u_unit": lightmap.unit},
        )
        yield
        if self._merge is None or self._nodes_target is None:
            return
        for row in range(0, senders.sent_size[1], ROWS):
            self._merge.draw(
                self._nodes_target,
                textures=senders.some("t_texels", "t_place", "t_facing") | {"t_sent": self._sent},
                uniforms={
                    "u_senders": senders.table.senders,
                    "u_level": senders.window.bit_length() - 1,
                    "u_threshold": threshold,
                    "u_mean": mean,
                },
                viewport=(0, row, ENTRIES_A_ROW, min(ROWS, senders.sent_size[1] - row)),
            )
            self._gpu.ctx.finish()
            yield

    def release(self) -> None:
        targets = [self._target] + ([self._nodes_target] if self._nodes_target is not None else [])
        self._gpu.release_all(*targets, self._sent, *self._nodes.values())
