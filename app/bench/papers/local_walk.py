"""A walk through a world that the local matrix lights shows how long its steps take, and how far the light that is shown is from
the whole solution."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from app.bench.papers.whole_solution import WholeSolution, shown_light, texture_of
from app.gpu import Gpu
from app.render.camera import CameraView
from app.render.frame import FrameRenderer
from app.render.options import DisplayOptions
from app.render.resolve import Reference
from app.scene.model import F64
from app.solvers.local.solver import Local
from app.util.parts import run_to_end

STEPS = 500
EVERY = 25  # steps, of which the last is compared
FORESEEN = 20  # steps, after which it is known what the whole walk will take
NEAR = 16.0  # m from the eye
PICTURE = 320, 180  # px


@dataclass
class Differences:
    """Differences of light from that of the whole solution are over the mean of that: a mean of each step that was compared, and
    of all of them each texel's."""

    means: list[float] = field(default_factory=list)
    texels: list[F64] = field(default_factory=list)

    def add(self, light: F64, whole: F64) -> None:
        """light, whole (n, 3)."""
        apart = np.abs(light - whole).mean(1) / whole.mean()
        self.means.append(float(apart.mean()))
        self.texels.append(apart.astype(np.float32))

    @property
    def mean(self) -> float | None:
        return float(np.mean(self.means)) if self.means else None

    @property
    def p99(self) -> float | None:
        return float(np.percentile(np.concatenate(self.texels), 99)) if self.texels else None


@dataclass
class LocalWalk:
    """A walk came to this. step_ms: of each step. swapped: nodes that entered. foreseen: seconds of all steps, where that was
    more than they may take: nothing is compared then. pictures: mean differences of pixels [0, 1], as displayed."""

    step_ms: list[float] = field(default_factory=list)
    swapped: int = 0
    foreseen: float | None = None
    indirect: Differences = field(default_factory=Differences)
    indirect_near: Differences = field(default_factory=Differences)
    indirect_inside: Differences = field(default_factory=Differences)
    total: Differences = field(default_factory=Differences)
    total_near: Differences = field(default_factory=Differences)
    pictures: list[float] = field(default_factory=list)

    @property
    def picture(self) -> float | None:
        return float(np.mean(self.pictures)) if self.pictures else None

    @property
    def text(self) -> str:
        if self.foreseen is not None:
            return f"left out: about {self.foreseen:,.0f} s"
        return f"{len(self.step_ms)} steps, {len(self.pictures)} compared"


def steps_of(cameras: Sequence[CameraView], count: int) -> list[CameraView]:
    """So many of the cameras are taken, evenly, from the first to the last."""
    return [cameras[round(at)] for at in np.linspace(0, len(cameras) - 1, count)]


def walk(
    gpu: Gpu, made: Local, whole: WholeSolution, cameras: Sequence[CameraView], seconds: float, every: int = EVERY
) -> LocalWalk:
    """The solver does one piece of work for each camera, as in a window that shows each. seconds: that all steps may take; where
    they would take more, only the first FORESEEN are made."""
    done, before, spent = LocalWalk(), made.issued, 0.0
    pictures = _Pictures(gpu, made, whole)
    try:
        for step, camera in enumerate(cameras, 1):
            start = time.perf_counter()
            made.set_observer(camera.eye)
            run_to_end(made.work(1))
            gpu.ctx.finish()
            spent += time.perf_counter() - start
            done.step_ms.append((time.perf_counter() - start) * 1e3)
            done.swapped = made.issued - before
            if step == FORESEEN and (foreseen := spent / step * len(cameras)) > seconds:
                return LocalWalk(done.step_ms, done.swapped, foreseen)
            if step % every == 0:
                _compare(done, made, whole, camera)
                done.pictures.append(pictures.difference(camera))
    finally:
        pictures.release()
    return done


def _compare(done: LocalWalk, made: Local, whole: WholeSolution, camera: CameraView) -> None:
    """The light that is shown now is compared with the whole solution."""
    space, patches = made.lightmap.space, made.patches
    shown = shown_light(made)
    eye = space.local_from_world(camera.eye)
    near = np.linalg.norm(patches.centre[: patches.count] - eye, axis=1) * space.scale < NEAR
    indirect = shown - whole.direct
    done.total.add(shown, whole.total)
    done.indirect.add(indirect, whole.indirect)
    inside = made.set.slot[: patches.count] >= 0  # patches themselves, not in a cluster
    if inside.any():
        done.indirect_inside.add(indirect[inside], whole.indirect[inside])
    if near.any():
        done.total_near.add(shown[near], whole.total[near])
        done.indirect_near.add(indirect[near], whole.indirect[near])


class _Pictures:
    """Pictures of what is shown and of the whole solution have the same exposure and tone curve. Whoever makes it releases it."""

    def __init__(self, gpu: Gpu, made: Local, whole: WholeSolution) -> None:
        self._gpu, self._lightmap = gpu, made.lightmap
        self._renderer = FrameRenderer(gpu)
        self._display = DisplayOptions(exposure=whole.exposure)
        self._whole = Reference(texture_of(gpu, made, whole.total), 0.0)
        self._texture = gpu.texture(PICTURE, 4, "f1")
        self._target = gpu.target(self._texture)

    def _picture(self, camera: CameraView, show: str) -> F64:
        self._renderer.render(
            self._target, PICTURE, self._lightmap, camera, self._display.replace(show=show), reference=self._whole
        )
        self._gpu.ctx.finish()
        return np.frombuffer(self._texture.read(), np.uint8).reshape(-1, 4)[:, :3] / 255

    def difference(self, camera: CameraView) -> float:
        """The mean difference over all pixels and colours."""
        return float(np.abs(self._picture(camera, "solution") - self._picture(camera, "reference")).mean())

    def release(self) -> None:
        self._renderer.release()
        self._gpu.release_all(self._target, self._texture, self._whole.texture)
