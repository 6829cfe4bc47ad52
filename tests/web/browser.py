"""Pages in headless Chromium, drawn by its software renderer, and what they look like."""

from __future__ import annotations

import contextlib
import functools
import http.server
import shutil
import subprocess
import threading
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
SIZE = (320, 240)  # px, of a picture
ROOM = 200  # px more that the window is large, with what surrounds the page
TRIES = 3  # virtual time can pass while a slow machine still reads a page's files: it is blank then
FLAGS = (
    *("--headless=new", "--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--hide-scrollbars"),
    *("--force-device-scale-factor=1", "--force-color-profile=srgb", "--virtual-time-budget=30000"),
)


@contextlib.contextmanager
def served(folder: Path) -> Iterator[str]:
    """The address of a folder on a web server of this machine."""

    class Quiet(http.server.SimpleHTTPRequestHandler):
        def log_message(self, *args: object) -> None:
            pass

    server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), functools.partial(Quiet, directory=str(folder)))
    thread = threading.Thread(target=server.serve_forever)
    thread.start()
    try:
        yield f"http://127.0.0.1:{server.server_port}"
    finally:
        server.shutdown()
        thread.join()
        server.server_close()


def pictures_of_pages(addresses: Sequence[str], folder: Path) -> list[np.ndarray]:
    """(height, width, 3) of what each page shows once all are at rest, side by side in one window. folder: for what Chromium
    writes. The test is skipped without Chromium."""
    if CHROMIUM is None:
        pytest.skip("Chromium is not installed")
    (width, height), count = SIZE, len(addresses)
    style = f"width:{width}px;height:{height}px;border:0;position:absolute;top:0"
    frames = [f'<iframe src="{at}" style="{style};left:{width * k}px"></iframe>' for k, at in enumerate(addresses)]
    (folder / "frames.html").write_text("<!doctype html>" + "".join(frames))
    shot = folder / "pages.png"
    options = [f"--window-size={width * count + ROOM},{height + ROOM}", f"--user-data-dir={folder / 'profile'}"]
    line = [CHROMIUM, *FLAGS, *options, f"--screenshot={shot}", (folder / "frames.html").as_uri()]
    for _ in range(TRIES):
        run = subprocess.run(line, capture_output=True, text=True, timeout=200)
        assert shot.is_file(), run.stderr[-2000:]
        image = np.asarray(Image.open(shot).convert("RGB"))
        pictures = [image[:height, width * k : width * (k + 1)] for k in range(count)]
        if all(np.ptp(picture) > 0 for picture in pictures):
            break
    return pictures


def apart(one: np.ndarray, other: np.ndarray) -> float:
    """Mean difference of two pictures, of white."""
    return float(np.abs(one.astype(float) - other.astype(float)).mean() / 255)
