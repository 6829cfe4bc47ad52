"""Files in the window: what is opened and saved, by menu, keys, drop and dialog, and what was opened lately."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from imgui_bundle import imgui

from app.scene.library import scenes_folder
from app.session.keeping import SUFFIX
from app.session.settings import Settings, settings_of, write_settings
from app.ui import recovery, settings, theme
from app.ui.file_dialog import FileDialog
from app.ui.save_dialog import SaveDialog
from app.ui.state import State

if TYPE_CHECKING:
    from app.session.view import View

ICONS = theme.ICONS
IRRADIANCE = ".exr"
SETTINGS = ".toml"
AUTHORED = "The scenes that come along are under File > Scenes."
BAKES = "'glowtree bake' writes an irradiance.exr."
WRITTEN = "File > Settings > Save settings writes one."


class Files:
    """The dialogs of a window. suffixes: of scenes."""

    def __init__(self, suffixes: Sequence[str], *, native: bool | None = None) -> None:
        kinds = (*suffixes, SUFFIX) if suffixes else ()
        self._scenes = FileDialog("Open a scene or session", "Scenes and sessions", kinds, AUTHORED, native=native)
        self._bakes = FileDialog("Open a bake", "Irradiance", (IRRADIANCE,), BAKES, native=native)
        self._settings = FileDialog("Open settings", "Settings", (SETTINGS,), WRITTEN, native=native)
        self._session_name = SaveDialog("Save the session", SUFFIX, native=native)
        self._settings_name = SaveDialog("Save settings", SETTINGS, native=native)
        self._folders = FileDialog("Bake into a folder", "Folders", (), "", native=native, folders=True)
        self._known: object = None

    @property
    def waiting(self) -> bool:
        """Whether a dialog of the desktop's own is open, from which no event comes."""
        dialogs = (self._scenes, self._bakes, self._settings, self._session_name, self._settings_name, self._folders)
        return any(dialog.waiting for dialog in dialogs)

    def frame(self, view: View, state: State) -> None:
        """Open the dialogs that were asked for, and do what they answer."""
        if state.ask_for_file:
            state.ask_for_file = False
            self._scenes.open()
        if state.ask_for_reference:
            state.ask_for_reference = False
            self._bakes.open()
        if state.ask_for_settings:
            state.ask_for_settings = False
            self._settings.open()
        if state.ask_for_session_name:
            state.ask_for_session_name = False
            self._session_name.open(_proposed(view, state))
        if state.ask_for_settings_name:
            state.ask_for_settings_name = False
            self._settings_name.open(Path.cwd() / f"settings{SETTINGS}")
        if state.ask_for_folder:
            state.ask_for_folder = False
            self._folders.open()
        if (folder := self._folders.poll()) is not None and state.order is not None:
            state.order = replace(state.order, folder=folder)
        for dialog in (self._scenes, self._bakes):
            if (chosen := dialog.poll((lambda: state.recent.paths) if dialog is self._scenes else tuple)) is not None:
                open_file(view, state, chosen)
        if (chosen := self._settings.poll()) is not None:
            state.act(partial(_put_settings, view, state, chosen))
        if (named := self._settings_name.poll()) is not None:
            state.act(partial(_save_settings, view, state, named))
        if (named := self._session_name.poll()) is not None:
            state.act(partial(_save, view, state, named))
        elif not self._session_name.asking:
            state.after_saving = None

    def keep(self, view: View, state: State) -> None:
        """Once per frame: go on with a session that opens, put aside what is not saved, remember what was opened."""

        def put(given: Settings) -> None:
            settings.put(view, state, given)

        for note in state.keeping.poll(view, lambda: settings.tables(view, state), put):
            state.notify(note)
        opened = view.session.reading if view.session.opened else None
        if opened is not self._known:
            self._known = opened
            file = state.keeping.path or (None if opened is None else view.session.unedited.source)
            if file is not None and scenes_folder() not in file.parents:
                state.recent.add(file)


def open_file(view: View, state: State, file: Path) -> None:
    """A session, the light of a bake of the scene that is open, or a scene."""
    kind = file.suffix.lower()
    if kind == SUFFIX:
        state.leave_for(lambda: state.keeping.open(view, file))
    elif kind == IRRADIANCE and view.session.opened:
        state.act(lambda: view.session.compared.open(file))
    else:
        state.leave_for(lambda: view.session.open(file))


def save(view: View, state: State) -> None:
    """Save the session to its file, or ask for one."""
    if state.keeping.path is None:
        state.ask_for_session_name = True
    else:
        state.act(partial(_save, view, state, state.keeping.path))


def save_as(view: View, state: State) -> None:
    """Save the session to another file."""
    state.ask_for_session_name = True


def menu(view: View, state: State) -> None:
    """File, but for what the window itself does."""
    opened = view.session.opened
    if imgui.menu_item(f"{ICONS.ICON_FA_FOLDER_OPEN}  Open ...", "Ctrl+O", False)[0]:
        state.ask_for_file = True
    recent = state.recent.paths
    if imgui.begin_menu(f"{ICONS.ICON_FA_CLOCK}  Recent", bool(recent)):
        for path in recent:
            if imgui.menu_item(f"{path.name}###{path}", str(path.parent), False)[0]:
                open_file(view, state, path)
        imgui.separator()
        if imgui.menu_item("Forget these", "", False)[0]:
            state.recent.forget()
        imgui.end_menu()
    if imgui.begin_menu(f"{ICONS.ICON_FA_CUBES}  Scenes", bool(state.scenes)):
        for source in state.scenes:
            if imgui.menu_item(Path(source).stem, "", False)[0]:
                state.leave_for(partial(view.session.open, source))
        imgui.end_menu()
    recovery.menu(state)
    imgui.separator()
    if imgui.menu_item(f"{ICONS.ICON_FA_FLOPPY_DISK}  Save session", "Ctrl+S", False, opened)[0]:
        save(view, state)
    if imgui.menu_item("Save session as ...", "Ctrl+Shift+S", False, opened)[0]:
        save_as(view, state)
    if imgui.begin_menu(f"{ICONS.ICON_FA_SLIDERS}  Settings"):
        settings.menu(view, state)
        imgui.end_menu()
    imgui.separator()


def _proposed(view: View, state: State) -> Path:
    """Where a session would be saved, unless the user says otherwise."""
    if state.keeping.path is not None:
        return state.keeping.path
    source = view.session.unedited.source
    if source is None or scenes_folder() in source.parents:
        return Path.cwd() / f"{Path(str(view.session.source)).stem}{SUFFIX}"
    return source.with_suffix(SUFFIX).absolute()


def _save(view: View, state: State, path: Path) -> None:
    then, state.after_saving = state.after_saving, None
    state.keeping.save(view, path, settings.tables(view, state))
    state.recent.add(path)
    state.notify(f"saved {path}")
    if then is not None:
        state.act(then)


def _put_settings(view: View, state: State, path: Path) -> None:
    settings.put(view, state, settings_of(path, settings.KNOWN))
    state.notify(f"settings of {path.name}")


def _save_settings(view: View, state: State, path: Path) -> None:
    write_settings(path, settings.text(view, state))
    state.notify(f"saved {path}")


__all__ = ["Files", "menu", "open_file", "save", "save_as"]
