"""Options of a reference that is solved in the background: how fine it is, and when it is done."""

from __future__ import annotations

from dataclasses import dataclass

from app.atlas.options import MAX_TEXELS
from app.options import Options, option


@dataclass(frozen=True)
class ReferenceOptions(Options):
    texels: int | None = option(
        None,
        "texels of the reference; unset: four times as many",
        minimum=1,
        maximum=MAX_TEXELS,
        logarithmic=True,
        tip="Texels of the reference: more of them show errors of finer detail, and take longer",
    )
    residual: float = option(
        1e-4,
        "it is solved until this share of the emitted power is unshot",
        minimum=1e-9,
        maximum=1,
        logarithmic=True,
        label="Unshot at most",
        tip="The reference is done once this share of the emitted light is unshot: less is nearer to the truth, and "
        "takes longer",
        term="residual",
    )
