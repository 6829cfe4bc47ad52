"""The size that the window opens with."""

from __future__ import annotations

import pytest

from app.viewer.window import size_on_screen


@pytest.mark.parametrize(
    ("scale", "screen", "size"),
    [
        (1.0, (2560, 1440), (1280, 720)),
        (2.0, (3840, 2160), (2560, 1440)),
        (2.0, (1920, 1080), (1920, 1080)),
        (1.0, (900, 600), (900, 600)),
        (1.0, (1024, 768), (1024, 720)),
    ],
)
def test_it_grows_with_text_and_fits_on_the_screen(
    scale: float, screen: tuple[int, int], size: tuple[int, int]
) -> None:
    assert size_on_screen((1280, 720), scale, screen) == size
