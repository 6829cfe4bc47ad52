"""The open scene beside a reference: a bake, or a finer solve of the same scene that goes on in the background."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np

from app.atlas.options import MAX_TEXELS, AtlasOptions
from app.compare.comparison import Comparison, PreparedReference
from app.compare.options import ReferenceOptions
from app.compare.reference_task import ReferenceTask, bake_light, prepare_reference
from app.errors import UserError
from app.gpu import Gpu
from app.lightmap.lightmap import Lightmap
from app.scene.load import NO_LIGHT
from app.scene.model import RGB, Scene
from app.session.comparison_solve import solved_light

FINER = 4  # times as many texels as here: half their edge


class Compared:
    """What the light of the open scene is compared with. Whoever opens scenes calls ``begin`` for each lightmap, and ``poll``
    once per frame.

    comparison: with the reference that is there, or None; fetching: the reference on its way, or None.
    """

    def __init__(self, gpu: Gpu) -> None:
        self._gpu = gpu
        self._lightmap: Lightmap
        self._unedited: Scene
        self.comparison: Comparison | None = None
        self.fetching: ReferenceTask | None = None
        self._found: PreparedReference | None = None
        self._measured = True

    def begin(self, lightmap: Lightmap, unedited: Scene) -> bool:
        """Another lightmap, of the scene that was read as ``unedited``: a reference stays while the scene is the same one, cut
        anew. Whether one has gone."""
        self._lightmap, self._unedited = lightmap, unedited
        self._release_comparison()
        if self.fetching is not None and self.fetching.pool.scene is not unedited:
            self.stop_fetching()
        if self._found is not None and self._found.pool.scene is unedited:
            self._begin_comparison()
            return False
        gone = self._found is not None
        self.drop()
        return gone

    def restart(self) -> None:
        """The light begins again, and so do the errors."""
        if self.comparison is not None:
            self.comparison.begin()

    # -- references come and go ----------------------------------------------------------------------------------------

    def open(self, path: Path) -> None:
        """Read a bake in the background."""
        self._fetch(ReferenceTask(self._lightmap.pool, partial(bake_light, path, self._unedited)))

    def open_now(self, path: Path) -> None:
        """Read a bake and wait. Raises UserError."""
        light = bake_light(path, self._unedited, lambda stage, share: None)
        self._compare_with(prepare_reference(light, self._lightmap.pool))

    def solve(self, options: ReferenceOptions, scene: Scene | None = None) -> None:
        """Solve the scene as it is now in the background, with closed forms and full storage; or ``scene``, the same with other
        materials. Raises UserError."""
        scene = scene or self._lightmap.scene
        if not scene.emits:
            raise UserError(f"{scene.name}: {NO_LIGHT}")
        texels = options.texels or self.reference_texels
        atlas = AtlasOptions(texels=texels)
        self._fetch(ReferenceTask(self._lightmap.pool, lambda tell: solved_light(scene, atlas, options.residual, tell)))

    @property
    def reference_texels(self) -> int:
        """Of a reference for which none are asked."""
        pool = self._lightmap.pool
        return min(FINER * pool.uniform_texels(int(pool.leaves.level.max())), MAX_TEXELS)

    def stop_fetching(self) -> None:
        """The reference that is there stays."""
        if self.fetching is not None:
            self.fetching.cancel()
            self.fetching = None

    def drop(self) -> None:
        """Have no reference."""
        self._release_comparison()
        self._found = None

    def _fetch(self, fetching: ReferenceTask) -> None:
        self.stop_fetching()
        self.fetching = fetching

    def _compare_with(self, found: PreparedReference) -> None:
        self._release_comparison()
        self._found = found
        self._begin_comparison()

    def _begin_comparison(self) -> None:
        assert self._found is not None
        self.comparison, self._measured = Comparison(self._gpu, self._lightmap, self._found), False
        self._found = replace(self._found, pool=self._lightmap.pool, tiles=None)  # they are on the GPU now

    def _release_comparison(self) -> None:
        if self.comparison is not None:
            self.comparison.release()
            self.comparison = None

    # -- once per frame ------------------------------------------------------------------------------------------------

    def poll(self, work: int, seconds: float, state: object, *, wait: bool = False) -> str | None:
        """Take in a reference that has arrived, and measure. work, seconds: of the solve so far; state: all that the light
        depends on. Why the reference could not be had, if so."""
        trouble = None
        if self.fetching is not None and self.fetching.ended:
            fetching, self.fetching = self.fetching, None
            try:
                if fetching.pool.scene is self._unedited:
                    self._compare_with(fetching.result)
            except UserError as error:
                trouble = str(error)
        if self.comparison is not None:
            self._measured = self.comparison.measure(work, seconds, state, wait=wait)
        return trouble

    def irradiance_at(self, texel: tuple[int, int]) -> RGB | None:
        """Irradiance [W/m²] of the reference on a texel (column, row) of the tile pool; None without a reference."""
        if self.comparison is None:
            return None
        pool = self._lightmap.pool
        (x, column), (y, row) = (divmod(at, pool.tile) for at in texel)
        tiles = self.comparison.light.on_tiles(pool, np.array([y * pool.columns + x]))
        red, green, blue = tiles[0, row, column].tolist()
        return red, green, blue

    @property
    def busy(self) -> bool:
        """Whether a reference is on its way, or a measurement."""
        return self.fetching is not None or self.measuring

    @property
    def measuring(self) -> bool:
        """Whether a measurement is on its way."""
        return self.comparison is not None and not self._measured

    def release(self) -> None:
        self.stop_fetching()
        self._release_comparison()
