"""Bounces find the light that is left when every texel has given on what it received, along the rays that are kept.

    H = H_direct + 1/N Σ_k B(hit_k),    B = ρH

is linear; the largest eigenvalue of its matrix is about the mean albedo, λ = ρ̄: the Chebyshev semi-iteration [Golub61] solves it
in O(1/√(1 - λ)) steps where Jacobi needs O(1/(1 - λ)):

    H_{n+1} = ω_{n+1} (H_direct + 1/N Σ B(H_n) - H_{n-1}) + H_{n-1},    ω_1 = 1, ω_2 = 2/(2 - λ²), ω_{n+1} = 1/(1 - λ² ω_n / 4)

Where nearly all light is reflected, λ must be taken as less than it is, and what is slow then is the level of the light as a
whole: one factor brings it to where Σ A H = Σ A (H_direct + 1/N Σ B), the coarsest grid of a multigrid method [Stüben01].
"""

from __future__ import annotations

import math
from collections.abc import Generator, Iterator

import numpy as np

from app.gpu import Gpu, Pass, Texture, keep, take_over
from app.lightmap.lightmap import Lightmap
from app.scene.model import F64
from app.solvers.gathering.hits import Hits
from app.util.state import State

# Texels with few rays do not see each other alike: eigenvalues leave the real axis by about λ/√N, and the iteration diverges
# where that is more than the y of y + √(y² + λ²) = 1 + √(1 - λ²): 16 rays allow this.
MOST_REFLECTED = 0.95


def steps_to(tolerance: float, reflected: float) -> int:
    """Chebyshev steps after which the error is this share of what it was, at most."""
    rate = reflected / (1 + math.sqrt(1 - reflected**2))
    return 1 if rate <= 0 else max(1, math.ceil(math.log(2 / tolerance) / -math.log(rate)))


class Bounces:
    """Among the texels of one lightmap, the points: ``solution`` is H on each [stored units]. Whoever makes it releases it.

    reflected: λ, the mean albedo of the colour that is reflected most, textures of albedo taken as white. steps: of the last
    ``solve``.
    """

    def __init__(self, gpu: Gpu, points: Lightmap) -> None:
        self._gpu, self._points = gpu, points
        reads = points.defines("MATERIAL_BITS", "ALBEDO_TEXTURE")
        self._send = Pass(gpu, "solvers/gathering/outgoing", defines=reads)
        self._relax = Pass(gpu, "solvers/gathering/relax")
        self._sum = Pass(gpu, "solvers/gathering/rebalance", defines=points.defines("TILE"))
        self._scale = Pass(gpu, "solvers/gathering/scale")
        width, height = points.size
        self.outgoing = gpu.texture((width, height + 1), 4, "f4")  # one row more: see hit.glsl
        self._outgoing_target = gpu.target(self.outgoing)
        self._outgoing_target.clear()
        scene = points.scene
        area = np.bincount(scene.material_ids, scene.normals_areas[1], len(scene.materials))
        self._share = area / area.sum()  # of each material
        self.reflected, self.steps = 0.0, 0
        self._omega = 1.0  # of the last step
        size = points.size
        self._solutions = [gpu.texture(size, 4, "f4") for _ in range(2)]
        self._targets = [self._gpu.target(texture) for texture in self._solutions]
        self.gathered = self._gpu.texture(size, 4, "f4")
        self._gathered_target = self._gpu.target(self.gathered)
        self.clear()

    def clear(self) -> None:
        """No light."""
        self.steps = 0
        for target in (*self._targets, self._gathered_target):
            target.clear()

    def scale(self, factor: F64) -> None:
        """Multiply the solution, and the one before, by a factor (3,) for each channel."""
        for solution in self._targets:
            self._scale.draw(solution, uniforms={"u_factor": tuple(factor.tolist())}, blend="multiply")

    @property
    def solution(self) -> Texture:
        return self._solutions[0]

    def set_materials(self) -> None:
        """The lightmap's materials are others."""
        materials = self._points.scene.materials
        mean = self._share @ np.array([m.albedo for m in materials])
        self.reflected = min(float(mean.max()), MOST_REFLECTED)

    def solve(
        self, hits: Hits, direct: Texture, rays: int, steps: int, *, begun: int = 0
    ) -> Generator[None, None, None]:
        """So many steps from the solution as it is, along so many rays of each texel, in parts. begun: steps of these that the
        last solve took, along the same rays, and what they find was gathered since: it goes on."""
        omega, self.steps = self._omega if begun else 1.0, max(steps, begun)
        for step in range(begun, steps):
            if step == 0 or step > begun:
                yield from self.gather(hits, 0, rays, anew=True)
            if self.reflected >= MOST_REFLECTED and step > 0 and step in (1, steps // 2, steps - 1):
                self._rebalance(direct, rays)
                yield from self.gather(hits, 0, rays, anew=True)
            if step == 1:
                omega = 2 / (2 - self.reflected**2)
            elif step > 1:
                omega = 1 / (1 - self.reflected**2 * omega / 4)
            self._omega = omega
            self._solutions.reverse()
            self._targets.reverse()
            self._relax.draw(
                self._targets[0],
                textures={"t_direct": direct, "t_gathered": self.gathered},
                uniforms={"u_rays": rays, "u_omega": omega},
                blend="keep",
            )
            yield

    def _rebalance(self, direct: Texture, rays: int) -> None:
        """Scale the solution, and the one before, to the level at which it is even with what was just gathered from it. Waits for
        the GPU."""
        points, size = self._points, (self._points.columns, self._points.rows)
        sums = [self._gpu.texture(size, 4, "f4") for _ in range(2)]
        target = self._gpu.target(*sums)
        textures = {"t_direct": direct, "t_gathered": self.gathered, "t_solution": self.solution}
        self._sum.draw(target, textures=textures | points.textures("t_position_area"), uniforms={"u_rays": float(rays)})
        came, missing = (np.frombuffer(t.read(), np.float32).reshape(-1, 4).astype(np.float64).sum(0)[:3] for t in sums)
        self._gpu.release_all(target, *sums)
        self.scale(np.where(missing > 0, came / np.maximum(missing, 1e-300), 1.0))

    def gather(self, hits: Hits, first: int, count: int, *, anew: bool) -> Iterator[None]:
        """Add what so many rays of each texel find of the solution to ``gathered``, in parts; ``anew``: to nothing."""
        if anew:
            self.send()
            self._gathered_target.clear()
        yield from hits.gather(self._gathered_target, self.outgoing, first, count)

    def send(self) -> None:
        """B = ρH of the solution."""
        reads = "t_position_area", "t_normal_ids", "t_materials", "t_albedo"
        self._send.draw(
            self._outgoing_target,
            textures=self._points.textures(*reads) | {"t_solution": self.solution},
            viewport=(0, 0, *self._points.size),
        )

    def state(self) -> State:
        """The solution, the one before, and what was gathered."""
        state = State({"omega": self._omega, "steps": self.steps})
        keep(state, solution=self._solutions[0], before=self._solutions[1], gathered=self.gathered)
        return state

    def restore(self, state: State) -> None:
        """Have what is in a ``state``. Raises StateError."""
        take_over(state, solution=self._solutions[0], before=self._solutions[1], gathered=self.gathered)
        self._omega, self.steps = float(state.values["omega"]), int(state.values["steps"])
        self.send()

    def release(self) -> None:
        self._gpu.release_all(*self._targets, *self._solutions, self._gathered_target, self.gathered)
        self._gpu.release_all(self._outgoing_target, self.outgoing)
