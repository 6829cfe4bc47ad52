"""A state as a file: a zip that holds ``state.json``, the plain values and the names of the arrays, and each array as .npy.

Nothing is compressed and nothing is pickled. A file is written beside its place, flushed to the disk, and then put there at once:
whenever that is stopped, the file before it is still whole.
"""

from __future__ import annotations

import json
import zipfile
from pathlib import Path
from typing import IO, Any

import numpy as np
from numpy.lib import format as npy
from numpy.typing import NDArray

from app.errors import UserError
from app.util.files import partials_of, replacing
from app.util.state import State

FORMAT = "glowtree state 1"  # changes when what is written does
HEAD = "state.json"
MOST_HEAD = 1 << 28  # bytes
DAMAGED = (zipfile.BadZipFile, EOFError, LookupError, ValueError, TypeError, RuntimeError)  # what zipfile and numpy say


def write_state(path: Path, state: State) -> None:
    """Put the state there at once. Raises UserError where it cannot be written; the file that was there stays then."""
    try:
        with replacing(path) as partial, partial.open("wb") as file:
            dump_state(file, state)
    except OSError as error:
        raise UserError(f"{path}: cannot be written ({error.strerror or error})") from error


def remove_state(path: Path) -> None:
    """And what writes that were cut short have left."""
    for one in (path, *partials_of(path)):
        one.unlink(missing_ok=True)


def read_state(path: Path) -> State:
    """Raises UserError, in one line, for what is no such file, or only a part of one."""
    try:
        with path.open("rb") as file:
            return load_state(file)
    except FileNotFoundError:
        raise UserError(f"{path}: does not exist") from None
    except OSError as error:
        raise UserError(f"{path}: cannot be read ({error.strerror or error})") from error
    except UserError as error:
        raise UserError(f"{path}: {error}") from None


def dump_state(file: IO[bytes], state: State) -> None:
    """Write it to a file that is open."""
    head = {"format": FORMAT, "values": state.values, "arrays": list(state.arrays)}
    with zipfile.ZipFile(file, "w", zipfile.ZIP_STORED) as archive:
        archive.writestr(HEAD, json.dumps(head))
        for nth, array in enumerate(state.arrays.values()):
            with archive.open(_member(nth), "w", force_zip64=True) as member:
                npy.write_array(member, np.ascontiguousarray(array), allow_pickle=False)


def load_state(file: IO[bytes]) -> State:
    """Read it from a file that is open and can be searched. Raises UserError."""
    try:
        with zipfile.ZipFile(file) as archive:
            head = json.loads(_content(archive, HEAD, MOST_HEAD))
            if not isinstance(head, dict) or head.get("format") != FORMAT:
                raise UserError("was written by another version of glowtree")
            values, names = head["values"], head["arrays"]
            if not isinstance(values, dict) or not all(isinstance(name, str) for name in names):
                raise UserError("is damaged")
            return State(values, {name: _array(archive, _member(nth)) for nth, name in enumerate(names)})
    except DAMAGED as error:
        raise UserError("is damaged, or no light of glowtree") from error


def _member(nth: int) -> str:
    return f"{nth}.npy"


def _content(archive: zipfile.ZipFile, name: str, most: int) -> bytes:
    """The bytes of a small member, of which there may be at most so many."""
    if (size := _size(archive, name)) > most:
        raise ValueError(f"{name}: {size} bytes")
    return archive.read(name)


def _size(archive: zipfile.ZipFile, name: str) -> int:
    """Bytes of a member that is stored as it is: no more than the file has."""
    member = archive.getinfo(name)
    if member.compress_type != zipfile.ZIP_STORED or member.file_size != member.compress_size:
        raise ValueError(f"{name} is compressed")
    return member.file_size


def _array(archive: zipfile.ZipFile, name: str) -> NDArray[Any]:
    """An array whose shape says as much as there is."""
    size = _size(archive, name)
    with archive.open(name) as member:
        if npy.read_magic(member) != (1, 0):
            raise ValueError(name)
        shape, fortran, dtype = npy.read_array_header_1_0(member)
        count = int(np.prod(shape, dtype=object)) if shape else 1
        if fortran or dtype.hasobject or min(shape, default=1) < 0 or count * dtype.itemsize != size - member.tell():
            raise ValueError(name)
        data = member.read()  # all of it, so that its check sum is compared
    return np.frombuffer(data, dtype).reshape(shape)
