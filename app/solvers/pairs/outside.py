"""Light from outside, of the sky, the sun and lamps without area, which texels do not send: each bounce begins with it.

    H' = D + F (E + ρH)

D is found once by shadow rays from every texel (app/direct_light), whatever finds which texels see each other.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from app.direct_light.shadow_rays import DirectLight
from app.gpu import Framebuffer, Gpu, Pass
from app.lightmap.lightmap import Lightmap
from app.solvers.pairs.occlusion import Scenes
from app.util.state import State
from app.visibility.origins import Origins

SHADOW_RAYS = 64  # of each texel to each light, or to the sky


class Outside:
    """Of one lightmap. Whoever makes it releases it.

    sent: (2, 3) power that what ``find`` looked at sends out, and that of it which texels receive, RGB [W]; of directions both
    are what these receive.
    """

    def __init__(self, gpu: Gpu, lightmap: Lightmap, scenes: Scenes) -> None:
        self._gpu, self._lightmap, self._scenes = gpu, lightmap, scenes
        self._copy = Pass(gpu, "common/copy")
        self._origins: Origins | None = None
        self._direct: DirectLight | None = None
        self._known = False
        self.sent = np.zeros((2, 3))

    @property
    def _there(self) -> bool:
        """Whether there is any."""
        return self._lightmap.scene.lit_by_sky or self._lightmap.scene.lit_by_lights

    def change(self) -> None:
        """There is other light outside, or another unit of stored light."""
        self._known = False

    def find(self) -> Iterator[None]:
        """Look at what is not known yet, in parts. Raises UserError where there are too many triangles."""
        if self._known:
            return
        if not self._there:
            self.sent = np.zeros((2, 3))
            return
        direct, scene = self._made(), self._lightmap.scene
        direct.follow(scene)
        for _ in direct.catch_up(SHADOW_RAYS):
            self._gpu.ctx.finish()
            yield
        self._sum(direct)
        self._known = True

    def _sum(self, direct: DirectLight) -> None:
        """Add up what is known. Waits for the GPU."""
        direct.sum(self._lightmap.scene)
        afar = direct.from_outside()
        self.sent = np.stack([afar + self._lightmap.sent_by_points, afar + direct.from_points()])

    def _made(self) -> DirectLight:
        if self._direct is None:
            self._origins = Origins(self._gpu, self._lightmap)
            self._direct = DirectLight(self._gpu, self._lightmap, self._scenes.rays, self._origins, of_surfaces=False)
        return self._direct

    def write(self, target: Framebuffer) -> None:
        """D in place of the RGB of a target, and nothing in its alpha."""
        target.clear()
        if self._direct is not None and self._there:
            target.color_mask = (True, True, True, False)
            self._copy.draw(target, textures={"t_source": self._direct.light}, uniforms={"u_offset_px": (0, 0)})
            target.color_mask = (True, True, True, True)

    def state(self) -> State:
        """What shadow rays have found."""
        return State() if self._direct is None or not self._known else self._direct.state()

    def restore(self, state: State) -> None:
        """Know what is in a ``state``, and nothing else. Raises StateError."""
        self._known = bool(state.values)
        if self._known:
            direct = self._made()
            direct.restore(state, self._lightmap.scene)
            self._sum(direct)

    def release(self) -> None:
        for part in (self._direct, self._origins):
            if part is not None:
                part.release()


__all__ = ["Outside"]
