"""Asks where a file is to be saved: with the system's own dialog where there is one, else by folder and name."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from imgui_bundle import imgui, portable_file_dialogs

from app.ui import widgets
from app.ui.file_dialog import system_dialog
from app.ui.path_field import PathField

WIDTH_EM = 30.0


class SaveDialog:
    """Closed, or waiting for an answer. ``poll`` never blocks."""

    def __init__(self, title: str, suffix: str, *, native: bool | None = None) -> None:
        self._title, self._suffix = title, suffix
        self._native = system_dialog(native)
        self._pending: Any = None
        self._opening = self._shown = False
        self._path = PathField(f"A folder to {title[:1].lower()}{title[1:]} into", native=native)

    def open(self, first: Path) -> None:
        """Ask; ``first`` is what is proposed."""
        if not self._native:
            self._opening, self._path.text = True, str(first)
        elif self._pending is None:
            self._pending = portable_file_dialogs.save_file(self._title, str(first), [self._suffix, f"*{self._suffix}"])

    @property
    def waiting(self) -> bool:
        """Whether a dialog of the desktop's own is open, from which no event comes."""
        return self._pending is not None

    @property
    def asking(self) -> bool:
        """Whether an answer is still to come."""
        return self.waiting or self._opening or self._shown

    def poll(self) -> Path | None:
        """Once per frame: the file that was named just now, with its suffix, or None."""
        named = self._named() if self._pending is None else self._answered()
        return None if named is None else named if named.suffix == self._suffix else Path(f"{named}{self._suffix}")

    def _answered(self) -> Path | None:
        if not self._pending.ready(0):
            return None
        answer = self._pending.result()
        self._pending = None
        return Path(answer) if answer else None

    def _named(self) -> Path | None:
        if self._opening:
            imgui.open_popup(self._title)
        self._shown = widgets.begin_modal(self._title)
        if not self._shown:
            return None
        self._opening = False
        entered = self._path.draw(WIDTH_EM * imgui.get_font_size())
        path = Path(self._path.text.strip()).expanduser()
        trouble = self._trouble(path)
        widgets.dim(trouble or ("replaces the file that is there" if self._whole(path).is_file() else " "))
        imgui.begin_disabled(trouble is not None)
        saved = imgui.button("Save###save as") or (entered and trouble is None)
        imgui.end_disabled()
        imgui.same_line()
        escaped = imgui.is_key_pressed(imgui.Key.escape, False) and not self._path.browsing
        if imgui.button("Cancel###cancel save") or saved or escaped:
            imgui.close_current_popup()
            self._shown = False
        imgui.end_popup()
        return path.absolute() if saved else None

    def _whole(self, path: Path) -> Path:
        return path if path.suffix == self._suffix else Path(f"{path}{self._suffix}")

    def _trouble(self, path: Path) -> str | None:
        """Why nothing can be saved there."""
        if not self._path.text.strip() or path.is_dir():
            return "a name is missing"
        return None if path.absolute().parent.is_dir() else f"there is no folder {path.absolute().parent}"


__all__ = ["SaveDialog"]
