"""Answers that took long, kept as .npz files in the user's cache directory under a digest of all that they follow from."""

from __future__ import annotations

import contextlib
import hashlib
import os
import threading
import zipfile
from collections.abc import Callable, Collection, Iterator, Mapping
from concurrent.futures import Future, ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
import platformdirs
from numpy.typing import NDArray

from app.util.background import CancelledError, Report, unheard

Arrays = dict[str, NDArray[Any]]
Answer = bytes | Arrays | Callable[[], Arrays]

_folders: list[Path] = []  # instead of the user's, the last one
_writers: list[_Writer] = []  # that are at work
_own = threading.local()  # of a thread, ``writer``: who writes its answers


def digest(label: bytes, arrays: Mapping[str, NDArray[Any]]) -> str:
    """Of a label and named arrays: shapes, types and contents. The label changes when the answer's format or its maker does."""
    whole = hashlib.sha256(label)
    for name, array in arrays.items():
        whole.update(f"{name} {array.shape} {array.dtype}".encode())
        whole.update(np.ascontiguousarray(array).data)
    return whole.hexdigest()


@contextlib.contextmanager
def elsewhere(folder: Path) -> Iterator[None]:
    """Answers are kept in another folder while inside."""
    _folders.append(folder)
    try:
        yield
    finally:
        _folders.remove(folder)


def entry(kind: str, name: str) -> Path:
    """Where the answer of this digest is, or would be."""
    folder = _folders[-1] if _folders else Path(platformdirs.user_cache_dir("glowtree"))
    return folder / kind / f"{name}.npz"


def read(path: Path, only: Collection[str] | None = None) -> Arrays | None:
    """The arrays of a file, or some of them, or None where there is no such file or it is not whole, as far as it is read."""
    try:
        with np.load(path) as data:
            return {name: np.asarray(data[name]) for name in (data.files if only is None else only)}
    except Exception:  # what is no .npz file, or half of one, makes numpy and zipfile raise nearly anything
        return None


def write(path: Path, arrays: Mapping[str, NDArray[Any]], report: Report = unheard) -> None:
    """A file of them, array by array; report may raise between two. Raises OSError."""
    with zipfile.ZipFile(path, "w") as file:
        for k, (name, array) in enumerate(arrays.items()):
            report(k / len(arrays))
            with file.open(f"{name}.npy", "w", force_zip64=True) as entry:
                np.lib.format.write_array(entry, np.asarray(array), allow_pickle=False)


class _Writer:
    """Writes answers in a thread of its own, one after the other. failures: why some of any thread could not be written since.
    stopped: what is not yet written is not wanted any more."""

    def __init__(self) -> None:
        self.failures: list[str] = []
        self.stopped = False
        self._answers: list[Future[None]] = []
        self._thread = ThreadPoolExecutor(1)

    def submit(self, answer: Answer, path: Path, files: int) -> None:
        self._answers.append(self._thread.submit(_store, answer, path, files, self._alive))

    def _alive(self, _share: float) -> None:
        if self.stopped:
            raise CancelledError

    def finish(self) -> None:
        """Wait for all. Raises what is no failure of the disk."""
        for answer in self._answers:
            answer.result()

    def stop(self) -> None:
        """Wait for nothing."""
        self.stopped = True
        self._thread.shutdown(wait=False, cancel_futures=True)


@contextlib.contextmanager
def written_beside() -> Iterator[list[str]]:
    """What this thread keeps is written by another one while inside, and is there after. It must not change until then. Who
    leaves by an error waits for nothing: what is not yet written is dropped. The list says after, in a line each, why answers of
    any thread could not be written."""
    outer, writer = getattr(_own, "writer", None), _Writer()
    _own.writer = writer
    _writers.append(writer)
    try:
        yield writer.failures
        writer.finish()
    finally:
        _own.writer = outer
        _writers.remove(writer)
        writer.stop()


def store(answer: Answer, path: Path, files: int) -> None:
    """Keep arrays, what makes them, or a file of them, for next time, and of its kind the newest so many; a cache that cannot be
    written is none."""
    writer: _Writer | None = getattr(_own, "writer", None)
    if writer is None:
        _store(answer, path, files)
    else:
        writer.submit(answer, path, files)


def _store(answer: Answer, path: Path, files: int, report: Report = unheard) -> None:
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        partial = path.with_suffix(f".{os.getpid()}-{threading.get_ident()}.tmp")
        try:
            if isinstance(answer, bytes):
                partial.write_bytes(answer)
            else:
                write(partial, answer() if callable(answer) else answer, report)
            report(1.0)
            partial.replace(path)
        finally:
            partial.unlink(missing_ok=True)
        by_age = sorted(path.parent.glob("*.npz"), key=lambda p: p.stat().st_mtime, reverse=True)
        for old in by_age[files:]:
            old.unlink()
    except CancelledError:
        return
    except (OSError, MemoryError) as error:
        reason = error.strerror if isinstance(error, OSError) and error.strerror else "not enough memory"
        for writer in [*_writers]:
            writer.failures.append(f"{path.parents[1]}: {reason}")
