"""The knobs of gathering."""

from __future__ import annotations

from dataclasses import dataclass

from app.options import Options, option


@dataclass(frozen=True)
class GatheringOptions(Options):
    """``smooth`` acts on what is shown, the rest on the next rays: none restarts the solution."""

    noise: float = option(
        1e-2,
        "converged when the noise that is left, the mean over all surfaces, is so much of the mean irradiance",
        minimum=1e-5,
        maximum=1,
        logarithmic=True,
        label="Noise at most",
        tip="The solve has converged once the noise of the light, over its mean, is no more than this. Half of it "
        "takes four times the rays",
        term="standard error",
    )
    ray_memory: int = option(
        1024,
        "memory for what rays hit, of 16 rays of each texel at least; those beyond it are traced again in each bounce",
        unit="MiB",
        minimum=0,
        maximum=65_536,
        logarithmic=True,
        tip="Memory for what rays have hit, 4 bytes each. What is kept makes bounces and edits of light nearly free; "
        "rays beyond it are traced again in each bounce",
        term="visibility cache",
    )
    smooth: bool = option(
        True,
        "smooth indirect light within charts, by as much as it is noisy",
        tip="Smooths indirect light in the picture, by no more than it is noisy. It costs little; off, the light is "
        "as it was gathered",
    )
