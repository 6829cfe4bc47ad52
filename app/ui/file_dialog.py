"""Asks for a file: with the system's own dialog where there is one, else with a plain list of folders and files."""

from __future__ import annotations

import shutil
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from imgui_bundle import imgui, portable_file_dialogs

from app.ui import theme, widgets

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
        self._folders = folders
        self._title, self._kind, self._hint = title, kind, hint
        self._suffixes = tuple(suffixes)
        self._native = system_dialog(native)
        self._pending: Any = None
        self._folder = Path.cwd()
        self._opening = False

    def open(self) -> None:
        """Ask, from the folder of the last answer on."""
        if not self._native:
            self._opening = True
        elif self._pending is None and self._folders:
            self._pending = portable_file_dialogs.select_folder(self._title, str(self._folder))
        elif self._pending is None:
            patterns = " ".join(f"*{s}" for s in self._suffixes) or "*"
            self._pending = portable_file_dialogs.open_file(self._title, str(self._folder), [self._kind, patterns])

    @property
    def waiting(self) -> bool:
        """Whether a dialog of the desktop's own is open, from which no event comes."""
        return self._pending is not None

    def poll(self) -> Path | None:
        """Once per frame: the file that was chosen just now, or None."""
        chosen = self._listed() if self._pending is None else self._answered()
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

    def _listed(self) -> Path | None:
        if self._opening:
            imgui.open_popup(self._title)
            self._opening = False
        em = imgui.get_font_size()
        imgui.set_next_window_size(imgui.ImVec2(SIZE_EM[0] * em, SIZE_EM[1] * em), imgui.Cond_.appearing)
        imgui.set_next_window_pos(imgui.get_main_viewport().get_center(), imgui.Cond_.appearing, imgui.ImVec2(0.5, 0.5))
        if not imgui.begin_popup_modal(self._title, None, imgui.WindowFlags_.no_saved_settings)[0]:
            return None
        imgui.text_unformatted(str(self._folder))
        imgui.begin_child("files", imgui.ImVec2(0, -imgui.get_frame_height_with_spacing()), imgui.ChildFlags_.borders)
        chosen = self._entries()
        imgui.end_child()
        if self._folders and imgui.button("Take this folder"):
            chosen = self._folder
        if self._folders:
            imgui.same_line()
        if imgui.button("Cancel") or chosen is not None or imgui.is_key_pressed(imgui.Key.escape, False):
            imgui.close_current_popup()
        imgui.end_popup()
        return chosen

    def _entries(self) -> Path | None:
        chosen = None
        if imgui.selectable(f"{theme.ICONS.ICON_FA_ARROW_UP}  ..", False, imgui.SelectableFlags_.no_auto_close_popups)[
            0
        ]:
            self._folder = self._folder.parent
        entries = readable(self._folder, self._suffixes)
        if not self._folders and not any(entry.is_file() for entry in entries):
            wanted = f" ({' '.join(self._suffixes)})" if self._suffixes else ""
            widgets.wrapped(f"No files{wanted} here. {self._hint}", theme.DIM)
        for entry in entries:
            folder = entry.is_dir()
            icon = theme.ICONS.ICON_FA_FOLDER if folder else theme.ICONS.ICON_FA_CUBE
            imgui.begin_disabled(self._folders and not folder)
            if imgui.selectable(f"{icon}  {entry.name}", False, imgui.SelectableFlags_.no_auto_close_popups)[0]:
                if folder:
                    self._folder = entry
                else:
                    chosen = entry
            imgui.end_disabled()
        return chosen


def system_dialog(asked: bool | None) -> bool:
    """Whether the system's own dialogs are used: as asked for, else where there are any."""
    on_linux = sys.platform not in ("win32", "darwin")
    return any(map(shutil.which, HELPERS)) if asked is None and on_linux else asked is not False


def readable(folder: Path, suffixes: Sequence[str]) -> list[Path]:
    """Folders, then files with one of ``suffixes`` (any if there are none), by name; hidden ones and a folder that
    cannot be read give nothing.
    """
    try:
        entries = [e for e in folder.iterdir() if not e.name.startswith(".")]
        wanted = [e for e in entries if e.is_dir() or not suffixes or e.suffix.lower() in suffixes]
        return sorted(wanted, key=lambda e: (not e.is_dir(), e.name.lower()))
    except OSError:
        return []
