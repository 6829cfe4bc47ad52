"""Answers that took long, kept as .npz files in the user's cache directory under a digest of all that they follow from."""

from __future__ import annotations

import contextlib
import hashlib
import os
import threading
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
import platformdirs
from numpy.typing import NDArray

Arrays = dict[str, NDArray[Any]]

_folders: list[Path] = []  # instead of the user's, the last one
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


def read(path: Path) -> Arrays | None:
    """The arrays of a file, or None where there is no such file or it is not whole."""
    try:
        with np.load(path) as data:
            return {name: np.asarray(data[name]) for name in data.files}
    except Exception:  # what is no .npz file, or half of one, makes numpy and zipfile raise nearly anything
        return None


def write(path: Path, arrays: Mapping[str, NDArray[Any]]) -> None:
    """A file of them, array by array. Raises OSError."""
    with path.open("wb") as file:
        np.savez(file, allow_pickle=False, **arrays)


@contextlib.contextmanager
def written_beside() -> Iterator[None]:
    """What this thread keeps is written by another one while inside, and is there after. It must not change until then."""
    with ThreadPoolExecutor(1) as _own.writer:
        try:
            yield
        finally:
            del _own.writer


def store(answer: bytes | Arrays | Callable[[], Arrays], path: Path, files: int) -> None:
    """Keep arrays, what makes them, or a file of them, for next time, and of its kind the newest so many; a cache that cannot be
    written is none."""
    writer: ThreadPoolExecutor | None = getattr(_own, "writer", None)
    if writer is None:
        _store(answer, path, files)
    else:
        writer.submit(_store, answer, path, files)


def _store(answer: bytes | Arrays | Callable[[], Arrays], path: Path, files: int) -> None:
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        partial = path.with_suffix(f".{os.getpid()}-{threading.get_ident()}.tmp")
        try:
            if isinstance(answer, bytes):
                partial.write_bytes(answer)
            else:
                write(partial, answer() if callable(answer) else answer)
            partial.replace(path)
        finally:
            partial.unlink(missing_ok=True)
        by_age = sorted(path.parent.glob("*.npz"), key=lambda p: p.stat().st_mtime, reverse=True)
        for old in by_age[files:]:
            old.unlink()
    except OSError:
        return
