"""Keeping what is open: saved to a .glow file and opened again, and on the side every minute, for the case of a crash.

A .glow file is a state (util/state_file.py): a document and, where the solver has done any work, the light.
"""

from __future__ import annotations

import contextlib
import os
import threading
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from filelock import FileLock, Timeout

from app.atlas.options import AtlasOptions
from app.errors import UserError
from app.lightmap.options import LightmapOptions
from app.options import Options
from app.session.document import Document, document_of, found, put_back, read_document, reading_of, version_of
from app.session.light_state import light_state, restore_light
from app.session.loading import Loading
from app.session.session import Cut
from app.session.settings import TABLES, Settings, checked
from app.session.view import View
from app.util.state import State
from app.util.state_file import read_state, write_state

SUFFIX = ".glow"
DOCUMENT, LIGHT, PLACE = "document", "light", "place"  # names in the state
WORTH_SECONDS = 20.0  # of solving, from which on light is worth a question
EVERY_SECONDS = 60.0  # what is not saved is put aside
MOST_SHARE = 0.02  # of the time may go into that
MOST_ASIDE = 5  # files that crashes have left

Tables = Mapping[str, type[Options]]


@dataclass(frozen=True)
class Coming:
    """A session that is on its way. aside: the file that a crash left, if it is one."""

    loading: Loading
    document: Document
    settings: Settings
    light: State
    path: Path | None
    notes: list[str]
    aside: Path | None


@dataclass(eq=False)
class Aside:
    """A session that a crash has left: its file, the name of its scene, seconds that it was solved for, and when it was put there
    [s since 1970]. lock: held while it is looked at."""

    file: Path
    name: str
    seconds: float
    when: float
    lock: FileLock = field(repr=False)


class Keeping:
    """Saves and opens sessions of one view. ``folder`` keeps what is put aside; None: nothing is.

    path: of the session that is open, once it has one.
    """

    def __init__(self, folder: Path | None = None, known: Tables | None = None) -> None:
        """known: tables of settings that the host has, by name."""
        self._folder, self._tables = folder, TABLES if known is None else known
        self.path: Path | None = None
        self._coming: Coming | None = None
        self._scene: object = None  # another object for each that was opened, the same for versions of it
        self._saved: tuple[object, float] = (None, 0.0)  # edits, seconds of solving
        self._lock: FileLock | None = None
        self._due = time.monotonic() + EVERY_SECONDS
        self._aside_saved: tuple[object, float] | None = None
        self._writer: threading.Thread | None = None

    # -- saving --------------------------------------------------------------------------------------------------------

    def save(self, view: View, path: Path, tables: Mapping[str, Options]) -> None:
        """Put all that is open there, which is its file from now on. Raises UserError."""
        path = path if path.suffix == SUFFIX else path.with_name(path.name + SUFFIX)
        write_state(path, self._state(view, tables, path.parent))
        self.path, self._saved = path, _now(view)
        self._drop_own_aside()

    def unsaved(self, view: View) -> bool:
        """Whether there is something that nobody wants to lose by a slip: edits, or a solve that took long."""
        if not view.session.opened or self._coming is not None:
            return False
        if view.session.reading is not self._scene:
            return view.session.run.seconds >= WORTH_SECONDS
        return _worth(_now(view), self._saved)

    def _state(self, view: View, tables: Mapping[str, Options], folder: Path) -> State:
        session = view.session
        document = document_of(view, tables, folder)
        about = {"name": session.name, "seconds": session.run.seconds, "when": time.time()}
        state = State(
            {DOCUMENT: document.model_dump_json(), PLACE: None if self.path is None else str(self.path), **about}
        )
        if session.solver.issued > 0 and session.chosen_solver == session.solver_name:
            state.put(LIGHT, light_state(session))
        return state

    # -- opening -------------------------------------------------------------------------------------------------------

    def open(self, view: View, path: Path) -> None:
        """Start to open it; ``poll`` goes on. Raises UserError, in one line, for what is no session, or not whole."""
        self._open(view, path, read_state(path), path)

    def go_on(self, view: View, aside: Aside) -> None:
        """Open what a crash has left. Raises UserError."""
        state = read_state(aside.file)
        place = state.values.get(PLACE)
        self._open(view, aside.file, state, Path(place) if isinstance(place, str) else None, aside.file)
        aside.lock.release()

    def _open(self, view: View, file: Path, state: State, path: Path | None, aside: Path | None = None) -> None:
        try:
            document = read_document(state.values.get(DOCUMENT, ""))
            settings = checked(document.settings, "settings", self._tables)
            folder = (path or file).parent
            source, of_scene = found(document.scene, folder)
            reading, of_sky = reading_of(document, folder)
        except UserError as error:
            raise UserError(f"{file}: {error}") from None
        session = view.session
        cut = Cut(
            settings.of("texels", AtlasOptions()),
            settings.of("lightmap", LightmapOptions()),
            settings.solver or session.chosen_solver,
        )
        session.open(source, reading=reading, cut=cut, version=version_of(document))
        assert session.loading is not None
        notes = [note for note in (of_scene, of_sky) if note is not None]
        self._coming = Coming(session.loading, document, settings, state.part(LIGHT), path, notes, aside)

    def poll(
        self, view: View, tables: Callable[[], Mapping[str, Options]], put: Callable[[Settings], None]
    ) -> list[str]:
        """Once per frame: finish what is opened, and put aside what is not saved. tables: gives settings as they are; put:
        applies others. What there is to say."""
        session = view.session
        notes: list[str] = []
        scene = session.reading if session.opened else None
        coming = self._coming
        if coming is not None and session.loading is not coming.loading:
            self._coming = None
            if scene is not None and scene is not self._scene and session.loading is None:
                self._begin(view, coming.path)
                notes = self._arrive(view, coming, put)
                self._saved = _now(view)
        elif scene is not self._scene and scene is not None and coming is None:
            self._begin(view, None)
        if session.opened and time.monotonic() >= self._due:
            self._put_aside(view, tables())
        return notes

    def _begin(self, view: View, path: Path | None) -> None:
        """Another scene is open."""
        self._scene, self.path = view.session.reading, path
        self._saved, self._aside_saved = (_now(view)[0], 0.0), None

    def _arrive(self, view: View, coming: Coming, put: Callable[[Settings], None]) -> list[str]:
        session = view.session
        notes = list(coming.notes)
        put(coming.settings)
        notes += put_back(coming.document, view)
        if coming.light.values:
            try:
                restore_light(session, coming.light)
            except UserError as error:
                notes.append(f"{error}; it is solved anew")
                session.restart()
        elif session.solver.issued > 0:
            session.restart()
        if coming.aside is not None:
            with contextlib.suppress(OSError):
                self._own_aside().parent.mkdir(parents=True, exist_ok=True)
                os.replace(coming.aside, self._own_aside())
        return notes

    # -- put aside -----------------------------------------------------------------------------------------------------

    def _own_aside(self) -> Path:
        assert self._folder is not None
        return self._folder / f"{os.getpid()}{SUFFIX}"

    def _put_aside(self, view: View, tables: Mapping[str, Options]) -> None:
        """What would be lost by a crash; the file is written beside the frames."""
        self._due = time.monotonic() + EVERY_SECONDS
        busy = self._writer is not None and self._writer.is_alive()
        if self._folder is None or busy or not self.unsaved(view):
            return
        now = _now(view)
        if self._aside_saved is not None and not _worth(now, self._aside_saved, seconds=1.0):
            return
        start = time.monotonic()
        try:
            self._hold()
            state = self._state(view, tables, self._folder)
        except (OSError, UserError):
            return
        self._due += (time.monotonic() - start) / MOST_SHARE
        self._aside_saved = now
        self._writer = threading.Thread(target=_write_quietly, args=(self._own_aside(), state))
        self._writer.start()

    def _hold(self) -> None:
        """Let other processes know that this one lives. Raises OSError."""
        if self._lock is None:
            assert self._folder is not None
            self._folder.mkdir(parents=True, exist_ok=True)
            lock = FileLock(_lock_of(self._own_aside()))
            lock.acquire(timeout=0)
            self._lock = lock

    def asides(self) -> list[Aside]:
        """What crashes have left, the newest first; each is held until it is opened, dropped or left."""
        if self._folder is None:
            return []
        files = sorted(self._folder.glob(f"*{SUFFIX}"), key=_changed, reverse=True)
        held = [aside for file in files if (aside := _aside(file)) is not None]
        for aside in held[MOST_ASIDE:]:
            drop(aside)
        return held[:MOST_ASIDE]

    def _drop_own_aside(self) -> None:
        if self._folder is not None:
            if self._writer is not None:
                self._writer.join()
            self._own_aside().unlink(missing_ok=True)
        self._aside_saved = None

    def end(self) -> None:
        """The user has quit: nothing is left aside."""
        self._drop_own_aside()
        if self._lock is not None:
            self._lock.release()
            Path(self._lock.lock_file).unlink(missing_ok=True)
            self._lock = None


def check_session(path: Path) -> None:
    """Raise UserError, in one line, for what is no session, or not whole."""
    try:
        read_document(read_state(path).values.get(DOCUMENT, ""))
    except UserError as error:
        raise UserError(str(error) if str(error).startswith(str(path)) else f"{path}: {error}") from None


def drop(aside: Aside) -> None:
    """Forget what a crash has left."""
    aside.file.unlink(missing_ok=True)
    aside.lock.release()
    Path(aside.lock.lock_file).unlink(missing_ok=True)


def _now(view: View) -> tuple[object, float]:
    """What was made by hand, and seconds of solving."""
    session = view.session
    scene = session.edited_scene
    return (session.asked_surfaces, scene.materials, scene.lights, scene.sky, dict(view.bookmarks)), session.run.seconds


def _worth(now: tuple[Any, float], saved: tuple[Any, float], *, seconds: float | None = None) -> bool:
    """Whether what is now is worth more than what is saved. seconds: of solving that are."""
    begun_anew = now[1] < saved[1]
    solved = now[1] - (0.0 if begun_anew else saved[1])
    return now[0] != saved[0] or solved >= (WORTH_SECONDS if seconds is None else seconds)


def _lock_of(file: Path) -> Path:
    return file.with_suffix(".lock")


def _changed(file: Path) -> float:
    try:
        return file.stat().st_mtime
    except OSError:
        return 0.0


def _aside(file: Path) -> Aside | None:
    """What is in the file, if it is whole and whoever wrote it has ended."""
    lock = FileLock(_lock_of(file))
    try:
        lock.acquire(timeout=0)
    except (Timeout, OSError):
        return None
    try:
        values = read_state(file).values
        return Aside(file, str(values["name"]), float(values["seconds"]), float(values["when"]), lock)
    except (UserError, LookupError, TypeError, ValueError):
        lock.release()
        return None


def _write_quietly(path: Path, state: State) -> None:
    with contextlib.suppress(UserError):  # it is tried again in a minute
        write_state(path, state)


__all__ = ["SUFFIX", "WORTH_SECONDS", "Aside", "Keeping", "check_session", "drop"]
