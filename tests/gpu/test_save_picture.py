"""Pictures of the view alone as files: as the screen shows them, or as light, of any size."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from unittest.mock import Mock

import numpy as np
import OpenEXR
import pytest
from PIL import Image

from app.atlas.options import AtlasOptions
from app.errors import UserError
from app.gpu import Gpu
from app.render.options import DisplayOptions
from app.session.run import Stop
from app.session.session import Session
from app.session.view import View
from app.solvers import ShootingOptions
from app.ui.state import PictureFile, State
from app.viewer.picture import picture, save_picture
from app.viewer.saving import Pictures
from app.viewer.ui_frame import SAMPLES
from app.viewer.window import ViewerWindow

SIZE = (96, 64)


@pytest.fixture
def view(gpu: Gpu) -> Iterator[View]:
    session = Session(gpu, options=ShootingOptions(residual=0.5), atlas=AtlasOptions(texels=3000))
    view = View(session, DisplayOptions(tone_map="clamp", exposure=-1.0))
    session.open_now("textured-room")
    session.solve(Stop(work=16))
    yield view
    view.release()
    session.release()


def decoded(png: np.ndarray) -> np.ndarray:
    """Linear, IEC 61966-2-1 by hand."""
    shown = png / 255.0
    return np.where(shown <= 0.04045, shown / 12.92, ((shown + 0.055) / 1.055) ** 2.4)


@pytest.mark.parametrize("layer", ["combined", "albedo", "residual"])
def test_png_and_exr_are_the_same_light(view: View, tmp_path: Path, layer: str) -> None:
    """Where the light is even and not clipped; textured materials, lamps and what lies behind all of them, too."""
    view.display = view.display.replace(layer=layer)
    for name in ("a.png", "a.exr"):
        save_picture(view, tmp_path / name, SIZE)
    png = np.asarray(Image.open(tmp_path / "a.png"))
    assert (png == picture(view, SIZE)).all()
    file = OpenEXR.File(str(tmp_path / "a.exr"))
    light = file.channels()["RGB"].pixels
    assert light.shape == (SIZE[1], SIZE[0], 3) and light.dtype == np.float32
    assert file.header()["unit"] == "W/(sr m2)"
    gain = 1.0 if layer == "albedo" else 0.5
    off = np.abs(np.clip(gain * light, 0, 1) - decoded(png))
    # 8 bits of sRGB are half a step of 1/255 times the slope of the curve, at most 2.3, off; where edges clip, the mean of what
    # is clipped is another
    surfaces = light.sum(-1) > 0
    assert surfaces.mean() > 0.5
    assert np.quantile(off[surfaces], 0.95) < 2.3 / 255
    assert np.median(off[surfaces]) < 1.2 / 255
    if layer == "combined":
        assert light.max() > 4.0, "what the screen clips is there"


def test_a_picture_may_be_larger_than_any_window(view: View, tmp_path: Path) -> None:
    save_picture(view, tmp_path / "a.png", (2600, 10))
    assert Image.open(tmp_path / "a.png").size == (2600, 10)


def test_what_cannot_be_saved_is_one_line(view: View, gpu: Gpu, tmp_path: Path) -> None:
    limit = gpu.limits.max_texture
    for size in ((limit + 1, 10), (0, 10)):
        for name in ("a.png", "a.exr"):
            with pytest.raises(UserError, match=rf"each side must be 1 to {limit} on this GPU"):
                save_picture(view, tmp_path / name, size)
    with pytest.raises(UserError, match=r"a picture is a \.png or \.exr file"):
        save_picture(view, tmp_path / "a.jpg", SIZE)
    for name in ("a.png", "a.exr"):
        with pytest.raises(UserError, match="cannot be written"):
            save_picture(view, tmp_path / "nowhere" / name, SIZE)
    assert list(tmp_path.iterdir()) == []


def test_a_picture_is_drawn_in_parts_beside_the_window(view: View, tmp_path: Path) -> None:
    """What the window shows stays, whatever it draws in between; the file is that of the whole picture."""
    state, run = State(), view.session.run
    for _ in range(2):
        run.advance(fast=False, interactive=False)
    assert run._pace._last
    whole = picture(view, SIZE)
    saved = Pictures(view, state)
    saved.begin(PictureFile(tmp_path / "a.png", SIZE))
    texture = view.session.gpu.texture((32, 16), 4, "f1")
    other = view.session.gpu.target(texture)
    shares: list[float] = []
    while saved.busy:
        saved.step()
        view.draw(other, (32, 16))
        shares += [] if state.saving is None else [state.saving.share]
        assert len(shares) < 100
    assert not run._pace._last, "no time of solving"
    assert len(shares) == SAMPLES and sorted(shares) == shares and shares[-1] == 1.0
    assert (np.asarray(Image.open(tmp_path / "a.png")) == whole).all()
    assert [toast.text for toast in state.toasts] == [f"saved {tmp_path / 'a.png'}"]
    view.session.gpu.release_all(other, texture)


def test_a_picture_is_written_to_its_end_where_the_window_fails(view: View, tmp_path: Path) -> None:
    pictures = Pictures(view, State())
    pictures.begin(PictureFile(tmp_path / "a.png", SIZE))
    while pictures.drawing:
        pictures.step()
    fail = Mock(side_effect=RuntimeError("in a frame"))
    goes_on = {"_waits": lambda: False, "_at_rest": lambda: False}
    window = Mock(_pictures=pictures, _next_frame=fail, wnd=Mock(is_closing=False), **goes_on)
    with pytest.raises(RuntimeError, match="in a frame"):
        ViewerWindow.main_loop(window)
    assert not pictures.busy and Image.open(tmp_path / "a.png").size == SIZE


@pytest.mark.parametrize("name", ["a.png", "a.exr"])
def test_a_picture_that_is_stopped_leaves_nothing(view: View, tmp_path: Path, name: str) -> None:
    state = State()
    saved = Pictures(view, state)
    saved.begin(PictureFile(tmp_path / name, SIZE))
    saved.step()
    assert state.saving is not None and 0 < state.saving.share < 1 and saved.drawing
    state.saving.stopped = True
    saved.step()
    assert not saved.busy and state.saving is None and list(tmp_path.iterdir()) == [] and state.toasts == []


def test_what_cannot_be_saved_is_said_in_the_window(view: View, tmp_path: Path) -> None:
    for file in (PictureFile(tmp_path / "a.jpg", SIZE), PictureFile(tmp_path / "nowhere" / "a.png", SIZE)):
        state = State()
        saved = Pictures(view, state)
        saved.begin(file)
        while saved.busy:
            saved.step()
        assert [toast.error for toast in state.toasts] == [True] and state.saving is None
    assert list(tmp_path.iterdir()) == []
