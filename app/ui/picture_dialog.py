"""Asks where a picture of the view alone is saved, how large, and whether as the screen shows it or as light; then says how far
it is."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from imgui_bundle import imgui

from app.ui import widgets
from app.ui.path_field import PathField
from app.ui.state import PictureFile, Request, Saving, State

if TYPE_CHECKING:
    from app.session.view import View

TITLE, SAVING = "Save picture", "Saving the picture"
SIZES = ((1280, 720), (1920, 1080), (3840, 2160))
FORMATS = {".png": "PNG, as it is shown", ".exr": "EXR, linear radiance [W/(sr m²)]"}
WIDTH_EM, BUTTON_EM = 29.0, 7.0
MOST_PX = 1 << 16  # along a side, that can be typed; the GPU allows less


class PictureDialog:
    """Closed, or open with what has been typed."""

    def __init__(self, *, native: bool | None = None) -> None:
        self._size = 1, 1
        self._path = PathField("A folder for the picture", native=native)

    @property
    def waiting(self) -> bool:
        """Whether a dialog of the desktop's own is open, from which no event comes."""
        return self._path.waiting

    def draw(self, view: View, state: State) -> None:
        """Once per frame: opens where that was asked for; what is to be saved becomes a request to the host, which says how far
        it is."""
        if state.saving is not None or imgui.is_popup_open(SAVING):
            _progress(state.saving)
        if state.ask_for_picture:
            state.ask_for_picture = False
            self._begin(view, state)
            imgui.open_popup(TITLE)
        if not widgets.begin_modal(TITLE):
            return
        em = imgui.get_font_size()
        imgui.dummy(imgui.ImVec2(WIDTH_EM * em, 0))
        entered = self._fields(state)
        size = imgui.ImVec2(BUTTON_EM * em, 0)
        if imgui.button("Save", size) or entered:
            state.picture = PictureFile(Path(self._path.text).expanduser(), self._size)
            state.requests.append(Request.SAVE_PICTURE)
            imgui.close_current_popup()
        imgui.same_line()
        escaped = imgui.is_key_pressed(imgui.Key.escape, False) and not self._path.browsing
        if imgui.button("Cancel", size) or escaped:
            imgui.close_current_popup()
        imgui.end_popup()

    def _begin(self, view: View, state: State) -> None:
        """As large as the view, under the next free name in the folder of the last picture, or in the current one."""
        self._size = round(state.view_px[2] * state.ratio), round(state.view_px[3] * state.ratio)
        suffix = Path(self._path.text).suffix or ".png"
        self._path.text = str(free_name(self._folder, view.session.name.lower().replace(" ", "-"), suffix))

    def _fields(self, state: State) -> bool:
        """File, format and size; whether Enter was pressed."""
        widgets.labelled("File")
        entered = self._path.draw()
        widgets.labelled("Format")
        imgui.set_next_item_width(-1)
        suffixes = list(FORMATS)
        now = Path(self._path.text).suffix.lower()
        chosen = imgui.combo("##format", suffixes.index(now) if now in suffixes else -1, list(FORMATS.values()))
        if chosen[0]:
            self._path.text = str(Path(self._path.text or "picture").with_suffix(suffixes[chosen[1]]))
        widgets.labelled("Size [px]")
        imgui.set_next_item_width(-1)
        changed, typed = imgui.input_int2("##size", list(self._size))
        if changed:
            self._size = min(max(typed[0], 1), MOST_PX), min(max(typed[1], 1), MOST_PX)
        widgets.labelled("")
        view_size = round(state.view_px[2] * state.ratio), round(state.view_px[3] * state.ratio)
        for nth, size in enumerate((view_size, *SIZES)):
            if nth:
                imgui.same_line()
            if imgui.small_button("view" if nth == 0 else f"{size[0]}×{size[1]}"):
                self._size = size
        imgui.spacing()
        return entered

    @property
    def _folder(self) -> Path:
        last = Path(self._path.text).expanduser().parent
        return last if self._path.text and last.is_dir() else Path.cwd()


def _progress(saving: Saving | None) -> None:
    """How far the picture is, and a way to stop it; closes once there is none."""
    if not imgui.is_popup_open(SAVING):
        imgui.open_popup(SAVING)
    if not widgets.begin_modal(SAVING):
        return
    if saving is None:
        imgui.close_current_popup()
        imgui.end_popup()
        return
    em = imgui.get_font_size()
    widgets.wrapped(saving.name)
    imgui.progress_bar(saving.share, imgui.ImVec2(WIDTH_EM * em, 0), f"{saving.share:.0%}")
    if imgui.button("Cancel", imgui.ImVec2(BUTTON_EM * em, 0)) or imgui.is_key_pressed(imgui.Key.escape, False):
        saving.stopped = True
    imgui.end_popup()


def free_name(folder: Path, stem: str, suffix: str) -> Path:
    """``stem.suffix`` in a folder, or with the next free number."""
    path, number = folder / f"{stem}{suffix}", 1
    while path.exists():
        number += 1
        path = folder / f"{stem}-{number}{suffix}"
    return path
