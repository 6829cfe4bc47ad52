"""A list to choose a file from: by a path that is typed, which narrows the list, by arrow keys, or of what was opened lately."""

from __future__ import annotations

import os
import time
from collections.abc import Sequence
from pathlib import Path

from imgui_bundle import imgui

from app.ui import theme, widgets

RECENT_SHOWN = 4
FRESH_SECONDS = 1.0  # that a folder's entries are taken as they were
ICONS = theme.ICONS
ENTER = int(imgui.InputTextFlags_.enter_returns_true)
STAYS = int(imgui.SelectableFlags_.no_auto_close_popups)


class FileList:
    """The inside of a dialog. suffixes: of the files that are listed; hint: what is said in a folder without any. folders: there
    are only folders."""

    def __init__(self, suffixes: Sequence[str], hint: str, *, folders: bool = False) -> None:
        self._suffixes, self._hint, self._folders = tuple(suffixes), hint, folders
        self._folder = self._base = Path.cwd()
        self._text, self._trouble, self._at = "", "", -1
        self._known: tuple[Path, float, list[Path]] | None = None
        self._focus = False

    def begin(self, folder: Path) -> None:
        """It was opened: the folder's entries, and the path takes what is typed."""
        self._go(folder)
        self._focus = True

    @property
    def folder(self) -> Path:
        """Whose entries are shown."""
        return self._folder

    def draw(self, recent: Sequence[Path]) -> Path | None:
        """All of it but the buttons below; the file that was chosen."""
        entered = self._path()
        lately = [] if self._filter else [p for p in recent if self._wanted(p)][:RECENT_SHOWN]
        here = [self._folder.parent, *self._entries()]
        rows = [*lately, *here]
        moved = self._keys(len(rows))
        below = 2 if self._trouble else 1
        imgui.begin_child(
            "files", imgui.ImVec2(0, -below * imgui.get_frame_height_with_spacing()), imgui.ChildFlags_.borders
        )
        clicked = self._rows(lately, here, moved)
        imgui.end_child()
        if self._trouble:
            widgets.wrapped(self._trouble, theme.BAD)
        if clicked is not None:
            return self._take(clicked)
        if not (
            entered
            or imgui.is_key_pressed(imgui.Key.enter, False)
            or imgui.is_key_pressed(imgui.Key.keypad_enter, False)
        ):
            return None
        if 0 <= self._at < len(rows):
            return self._take(rows[self._at])
        typed, matches = self._typed, here[1:]
        return self._take(matches[0] if not os.path.exists(typed) and self._filter and len(matches) == 1 else typed)

    @property
    def _typed(self) -> Path:
        """What the text means: a path of its own, or one in the folder that is shown."""
        return self._base / os.path.expanduser(self._text.strip())

    @property
    def _filter(self) -> str:
        """The text that a name must contain to be listed."""
        return "" if not self._text.strip() or os.path.isdir(self._typed) else self._typed.name.lower()

    def _path(self) -> bool:
        """The text field; whether Enter was pressed in it."""
        if self._focus:
            imgui.set_keyboard_focus_here()
            self._focus = False
        imgui.set_next_item_width(-1)
        before = self._text
        entered, self._text = imgui.input_text_with_hint("##path", "a path, or a part of a name", self._text, ENTER)
        if self._text != before:
            self._at, self._trouble = -1, ""
            typed = self._typed
            self._folder = (
                typed if os.path.isdir(typed) else typed.parent if os.path.isdir(typed.parent) else self._base
            )
        widgets.dim(str(self._folder))
        return bool(entered)

    def _keys(self, rows: int) -> bool:
        """Up and down; whether another row is chosen now."""
        step = int(imgui.is_key_pressed(imgui.Key.down_arrow)) - int(imgui.is_key_pressed(imgui.Key.up_arrow))
        self._at = min(max(self._at + step, 0), rows - 1) if step else self._at
        return bool(step)

    def _rows(self, lately: list[Path], here: list[Path], moved: bool) -> Path | None:
        """The entries; the one that was clicked."""
        clicked = None
        if lately:
            imgui.separator_text("Opened lately")
        for index, path in enumerate(lately):
            clicked = path if self._row(index, path, f"{path.name}   {path.parent}", moved) else clicked
        if lately:
            imgui.separator_text("Here")
        for index, path in enumerate(here, start=len(lately)):
            name = ".." if index == len(lately) else path.name
            clicked = path if self._row(index, path, name, moved) else clicked
        if not self._folders and not any(path.is_file() for path in here):
            wanted = f" ({' '.join(self._suffixes)})" if self._suffixes else ""
            widgets.wrapped(f"No files{wanted} here. {self._hint}", theme.DIM)
        return clicked

    def _row(self, index: int, path: Path, name: str, moved: bool) -> bool:
        chosen = index == self._at
        icon = ICONS.ICON_FA_ARROW_UP if name == ".." else ICONS.ICON_FA_FOLDER if path.is_dir() else ICONS.ICON_FA_CUBE
        clicked = imgui.selectable(f"{icon}  {name}###{index}", chosen, STAYS)[0]
        if chosen and moved:
            imgui.set_scroll_here_y()
        return bool(clicked)

    def _take(self, path: Path) -> Path | None:
        """Go to a folder, or choose a file."""
        if os.path.isdir(path):
            self._go(path)
            return None
        if os.path.isfile(path) and not self._folders:
            return path
        self._trouble = f"there is no {'' if self._folders else 'file or '}folder {path}"
        return None

    def _go(self, folder: Path) -> None:
        self._folder = self._base = folder.resolve()
        self._text, self._trouble, self._at = "", "", -1

    def _entries(self) -> list[Path]:
        now = time.monotonic()
        if self._known is None or self._known[0] != self._folder or now - self._known[1] > FRESH_SECONDS:
            entries = readable(self._folder, self._suffixes)
            self._known = self._folder, now, [e for e in entries if not self._folders or e.is_dir()]
        return [entry for entry in self._known[2] if self._filter in entry.name.lower()]

    def _wanted(self, path: Path) -> bool:
        return not self._suffixes or path.suffix.lower() in self._suffixes


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
