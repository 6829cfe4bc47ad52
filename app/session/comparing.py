"""The open scene beside a reference: a bake, or a finer solve of the same scene that goes on in the background."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np

from app.atlas.options import MAX_TEXELS, AtlasOptions
from app.compare.comparison import Comparison, Found
from app.compare.fetching import Fetching, bake_light, looked_up
from app.compare.options import ReferenceOptions
from app.errors import UserError
from app.gpu import Gpu
from app.render.layers import LAYER_SHADERS
from app.render.options import DisplayOptions
from app.render.resolve import Reference
from app.scene.load import NO_LIGHT
from app.scene.model import RGB, Scene
from app.session.comparison_solve import solved_light
from app.session.viewing import Viewing
from app.solvers import ShootingOptions

FINER = 4  # times as many texels as here: half their edge


class Comparing(Viewing):
    """Whoever opens scenes is one, calls ``_compare`` each frame, and ``_compare_anew`` when the lightmap is another.

    comparison: with the reference that is there; fetching: the one on its way.
    """

    unedited: Scene
    message: str | None
    seconds: float

    def __init__(self, gpu: Gpu, display: DisplayOptions) -> None:
        super().__init__(gpu, display)
        self.comparison: Comparison | None = None
        self.fetching: Fetching | None = None
        self._found: Found | None = None
        self._measured = True

    # -- references come and go ----------------------------------------------------------------------------------------

    def open_reference(self, path: Path) -> None:
        """Read a bake in the background."""
        self._fetch(Fetching(self.lightmap.pool, partial(bake_light, path, self.unedited)))

    def open_reference_now(self, path: Path) -> None:
        """Read a bake and wait. Raises UserError."""
        light = bake_light(path, self.unedited, lambda stage, share: None)
        self._compare_with(looked_up(light, self.lightmap.pool))

    def solve_reference(self, options: ReferenceOptions) -> None:
        """Solve the scene as it is now in the background, with closed forms and full storage. Raises UserError."""
        scene = self.lightmap.scene
        if not scene.emits:
            raise UserError(f"{scene.name}: {NO_LIGHT}")
        texels = options.texels or self.reference_texels
        atlas, shooting = AtlasOptions(texels=texels), ShootingOptions(residual=options.residual)
        self._fetch(Fetching(self.lightmap.pool, lambda tell: solved_light(scene, atlas, shooting, tell)))

    @property
    def reference_texels(self) -> int:
        """Of a reference for which none are asked."""
        pool = self.lightmap.pool
        return min(FINER * pool.uniform_texels(int(pool.leaves.level.max())), MAX_TEXELS)

    def stop_fetching(self) -> None:
        """The reference that is there stays."""
        if self.fetching is not None:
            self.fetching.cancel()
            self.fetching = None

    def drop_reference(self) -> None:
        """Show the solution alone again."""
        self._release_comparison()
        self._found = None
        self.display = self._alone

    def _fetch(self, fetching: Fetching) -> None:
        self.stop_fetching()
        self.fetching = fetching

    def _compare_with(self, found: Found) -> None:
        self._release_comparison()
        self._found = found
        self._begin_comparison()

    def _begin_comparison(self) -> None:
        assert self._found is not None
        self.comparison, self._measured = Comparison(self.gpu, self.lightmap, self._found), False
        self._found = replace(self._found, pool=self.lightmap.pool, tiles=None)  # they are on the GPU now

    def _release_comparison(self) -> None:
        if self.comparison is not None:
            self.comparison.release()
            self.comparison = None

    # -- once per frame, and when the lightmap is another --------------------------------------------------------------

    def _compare(self, *, wait: bool = False) -> None:
        """Take in a reference that has arrived, and measure."""
        if self.fetching is not None and self.fetching.ended:
            fetching, self.fetching = self.fetching, None
            try:
                if fetching.pool.scene is self.unedited:
                    self._compare_with(fetching.result)
            except UserError as error:
                self.message = str(error)
        if self.comparison is not None:
            self._measured = self.comparison.measure(self.solver.shots, self.seconds, self._light, wait=wait)

    @property
    def _light(self) -> object:
        """What all light depends on: another one where it is another."""
        return self.solver.shots, self.lightmap.version, self.lightmap.scene, self.solver.options.ambient

    def _compare_anew(self) -> None:
        """Another lightmap: the reference stays while the scene is the same one, cut anew."""
        self._release_comparison()
        if self.fetching is not None and self.fetching.pool.scene is not self.unedited:
            self.stop_fetching()
        if self._found is not None and self._found.pool.scene is self.unedited:
            self._begin_comparison()
        elif self._found is not None:
            self.drop_reference()

    def reference_at(self, texel: tuple[int, int]) -> RGB | None:
        """Irradiance [W/m²] of the reference on a texel (column, row) of the tile pool; None without a reference."""
        if self.comparison is None:
            return None
        pool = self.lightmap.pool
        (x, column), (y, row) = (divmod(at, pool.tile) for at in texel)
        tiles = self.comparison.light.on_tiles(pool, np.array([y * pool.columns + x]))
        red, green, blue = tiles[0, row, column].tolist()
        return red, green, blue

    @property
    def comparing(self) -> bool:
        """Whether a reference is on its way, or a measurement."""
        return self.fetching is not None or (self.comparison is not None and not self._measured)

    # -- what is seen --------------------------------------------------------------------------------------------------

    @property
    def shown(self) -> DisplayOptions:
        return self._alone if self.comparison is None else self.display

    @property
    def _alone(self) -> DisplayOptions:
        """What can be shown without a reference."""
        layer = self.display.layer
        return self.display.replace(layer="combined" if LAYER_SHADERS[layer].compares else layer, show="solution")

    def _reference(self, *, whole: bool) -> Reference | None:
        display, comparison = self.display, self.comparison
        if comparison is None:
            return None
        if display.show != "solution" or LAYER_SHADERS[display.layer].compares:
            comparison.texels.follow(whole=whole)
        return Reference(comparison.texels.texture, float(np.sqrt(3.0)) * comparison.dark)

    def release(self) -> None:
        self.stop_fetching()
        self._release_comparison()
        super().release()
