"""FLIP, how different two pictures look when one takes the other's place [Andersson et al. 2020]; the one module that needs
flip-evaluator, which only the extra ``bench`` installs."""

from __future__ import annotations

import flip_evaluator
import numpy as np
from numpy.typing import NDArray


def flip(reference: NDArray[np.floating], picture: NDArray[np.floating]) -> float:
    """The mean over all pixels, 0 to 1, of two pictures (height, width, 3), sRGB from 0 to 1, at the method's own 67 pixels per
    degree."""
    images = (np.ascontiguousarray(image, np.float32) for image in (reference, picture))
    _, mean, _ = flip_evaluator.evaluate(*images, "LDR", applyMagma=False)
    return float(mean)
