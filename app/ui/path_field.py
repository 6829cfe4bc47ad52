"""A field for the path of a file that is to be written: typed, or its folder looked for in a list."""

from __future__ import annotations

from pathlib import Path

from imgui_bundle import imgui

from app.ui import theme, widgets
from app.ui.file_dialog import FileDialog

ENTER = int(imgui.InputTextFlags_.enter_returns_true)


class PathField:
    """Inside of a dialog. text: what is typed. browsing: whether the list of folders is open over it, which has the keys then."""

    def __init__(self, title: str, *, native: bool | None = None) -> None:
        """title: of the list of folders."""
        self.text, self.browsing = "", False
        self._folders = FileDialog(title, "Folders", (), "", native=native, folders=True)

    @property
    def waiting(self) -> bool:
        """Whether a dialog of the desktop's own is open, from which no event comes."""
        return self._folders.waiting

    def draw(self, width: float = 0.0) -> bool:
        """The field and its button, so wide, or as wide as there is room; whether Enter was pressed in it."""
        button, gap = 1.4 * imgui.get_frame_height(), imgui.get_style().item_spacing.x
        imgui.set_next_item_width((width or imgui.get_content_region_avail().x) - button - gap)
        if imgui.is_window_appearing():
            imgui.set_keyboard_focus_here()
        entered, self.text = imgui.input_text("##path", self.text, ENTER)
        imgui.same_line()
        if imgui.button(f"{theme.ICONS.ICON_FA_FOLDER_OPEN}###browse", imgui.ImVec2(button, 0)):
            self._folders.open(self._folder)
        widgets.tooltip("Choose a folder")
        self.browsing = self._folders.shown
        folder = self._folders.poll()
        if folder is not None:
            self.text = str(folder / Path(self.text).name)
        return bool(entered) and not self.browsing

    @property
    def _folder(self) -> Path:
        """That of the path, or the nearest above it that is there."""
        typed = Path(self.text.strip()).expanduser().absolute()
        return next((folder for folder in typed.parents if folder.is_dir()), Path.cwd())


__all__ = ["PathField"]
