"""Asks for a file: with the system's own dialog where there is one, else with a list of folders and files."""

from __future__ import annotations

import shutil
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from imgui_bundle import imgui, portable_file_dialogs

from app.ui.file_list import FileList

HELPERS = ("zenity", "kdialog", "matedialog", "qarma")  # what the system's dialog needs on Linux
SIZE_EM = (36.0, 26.0)


class FileDialog:
    """Closed, or waiting for an answer. ``poll`` never blocks."""

    def __init__(
        self,
        title: str,
        kind: str,
        suffixes: Sequence[str],
        hint: str,
        *,
        native: bool | None = None,
        folders: bool = False,
    ) -> None:
        """kind: of the files, as a plural; hint: what is said in a folder without any. folders: asks for a folder instead."""
        self._title, self._kind, self._suffixes, self._folders = title, kind, tuple(suffixes), folders
        self._list = FileList(suffixes, hint, folders=folders)
        self._native = system_dialog(native)
        self._pending: Any = None
        self._folder = Path.cwd()
        self._opening = False

    def open(self, folder: Path | None = None) -> None:
        """Ask, from that folder on, or from that of the last answer."""
        self._folder = folder or self._folder
        if not self._native:
            self._opening = True
        elif self._pending is None and self._folders:
            self._pending = portable_file_dialogs.select_folder(self._title, str(self._folder))
        elif self._pending is None:
            patterns = " ".join(f"*{s}" for s in self._suffixes) or "*"
            self._pending = portable_file_dialogs.open_file(self._title, str(self._folder), [self._kind, patterns])

    @property
    def shown(self) -> bool:
        """Whether its list stands over everything, or is about to."""
        return self._opening or imgui.is_popup_open(self._title)

    @property
    def waiting(self) -> bool:
        """Whether a dialog of the desktop's own is open, from which no event comes."""
        return self._pending is not None

    def poll(self, recent: Callable[[], Sequence[Path]] = tuple) -> Path | None:
        """Once per frame: the file that was chosen just now, or None. recent: asks for files that were opened lately."""
        chosen = self._listed(recent) if self._pending is None else self._answered()
        if chosen is not None:
            self._folder = chosen if self._folders else chosen.parent
        return chosen

    def _answered(self) -> Path | None:
        if not self._pending.ready(0):
            return None
        answer = self._pending.result()
        self._pending = None
        if not answer:
            return None
        return Path(answer if self._folders else answer[0])

    def _listed(self, recent: Callable[[], Sequence[Path]]) -> Path | None:
        if self._opening:
            imgui.open_popup(self._title)
            self._list.begin(self._folder)
            self._opening = False
        em = imgui.get_font_size()
        window = imgui.get_main_viewport().size
        size = imgui.ImVec2(min(SIZE_EM[0] * em, window.x), min(SIZE_EM[1] * em, window.y))
        imgui.set_next_window_size(size, imgui.Cond_.appearing)
        imgui.set_next_window_pos(imgui.get_main_viewport().get_center(), imgui.Cond_.appearing, imgui.ImVec2(0.5, 0.5))
        if not imgui.begin_popup_modal(self._title, None, imgui.WindowFlags_.no_saved_settings)[0]:
            return None
        chosen = self._list.draw(recent())
        if self._folders and imgui.button("Take this folder"):
            chosen = self._list.folder
        if self._folders:
            imgui.same_line()
        if imgui.button("Cancel") or chosen is not None or imgui.is_key_pressed(imgui.Key.escape, False):
            imgui.close_current_popup()
        imgui.end_popup()
        return chosen


def system_dialog(asked: bool | None) -> bool:
    """Whether the system's own dialogs are used: as asked for, else where there are any."""
    on_linux = sys.platform not in ("win32", "darwin")
    return any(map(shutil.which, HELPERS)) if asked is None and on_linux else asked is not False
