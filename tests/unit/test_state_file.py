"""States as files: whole or not at all, and nothing in them is trusted."""

from __future__ import annotations

import io
import json
import os
import pickle
import zipfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from app.errors import UserError
from app.util import state_file
from app.util.state import State, StateError, fitting
from app.util.state_file import dump_state, load_state, read_state, write_state


def some_state() -> State:
    inner = State({"far": float("inf"), "text": "größer"}, {"none": np.zeros((0, 3), np.int64)})
    state = State({"x": [1, 0.1, None]}, {"image": np.arange(24, dtype=np.float16).reshape(2, 3, 4)})
    state.put("part", inner)
    return state


def content(state: State) -> bytes:
    file = io.BytesIO()
    dump_state(file, state)
    return file.getvalue()


def test_comes_back_as_it_was(tmp_path: Path) -> None:
    path = tmp_path / "light"
    write_state(path, some_state())
    found = read_state(path)
    assert found.values == some_state().values
    assert found.part("part").values == {"far": float("inf"), "text": "größer"}
    for name, array in some_state().arrays.items():
        assert found.arrays[name].dtype == array.dtype
        assert np.array_equal(found.arrays[name], array)
    assert os.listdir(tmp_path) == ["light"]


def test_a_write_that_fails_leaves_the_file_before_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "light"
    write_state(path, some_state())
    before = path.read_bytes()

    def full(file: object, state: State) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(state_file, "dump_state", full)
    with pytest.raises(UserError, match="light: cannot be written \\(No space left on device\\)"):
        write_state(path, State())
    assert path.read_bytes() == before
    assert os.listdir(tmp_path) == ["light"]


@pytest.mark.parametrize("share", [0.0, 0.1, 0.5, 0.9, 0.999])
def test_a_part_of_a_file(share: float) -> None:
    whole = content(some_state())
    with pytest.raises(UserError, match="is damaged"):
        load_state(io.BytesIO(whole[: int(share * len(whole))]))


def test_any_changed_byte_is_noticed_or_changes_nothing() -> None:
    """Some bytes of a zip say nothing that is read, like times."""
    whole, rng = content(some_state()), np.random.default_rng(1)
    noticed = 0
    for at in rng.integers(0, len(whole), 400).tolist():
        spoilt = bytearray(whole)
        spoilt[at] ^= 0x55
        try:
            found = load_state(io.BytesIO(bytes(spoilt)))
        except UserError:
            noticed += 1
        else:
            assert found.values == some_state().values
            assert np.array_equal(found.arrays["image"], some_state().arrays["image"])
    assert noticed > 100


def archive(members: dict[str, bytes], how: int = zipfile.ZIP_STORED) -> bytes:
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w", how) as out:
        for name, data in members.items():
            out.writestr(name, data)
    return file.getvalue()


def npy_file(array: np.ndarray, *, pickled: bool = False) -> bytes:
    file = io.BytesIO()
    np.save(file, array, allow_pickle=pickled)
    return file.getvalue()


def head(**changes: object) -> bytes:
    return json.dumps({"format": state_file.FORMAT, "values": {}, "arrays": ["a"]} | changes).encode()


class Evil:
    def __reduce__(self) -> tuple[Callable[..., object], tuple[object, ...]]:
        return pytest.fail, ("something was unpickled",)


def promises(count: int) -> bytes:
    """The head of an array of so many numbers, and three of them."""
    file = io.BytesIO()
    np.lib.format.write_array_header_1_0(file, {"descr": "<f8", "fortran_order": False, "shape": (count,)})
    return file.getvalue() + np.zeros(3).tobytes()


HOSTILE = {
    "no zip": b"light",
    "no head": archive({"0.npy": npy_file(np.zeros(3))}),
    "a head that is no JSON": archive({"state.json": b"{"}),
    "a head that is a list": archive({"state.json": b"[]"}),
    "another version": archive({"state.json": head(format="glowtree state 0")}),
    "no such array": archive({"state.json": head()}),
    "names that are no texts": archive({"state.json": head(arrays=[1]), "0.npy": npy_file(np.zeros(3))}),
    "a pickle": archive({"state.json": head(), "0.npy": pickle.dumps(Evil())}),
    "objects": archive({"state.json": head(), "0.npy": npy_file(np.array([Evil()], object), pickled=True)}),
    "more than there is": archive({"state.json": head(), "0.npy": promises(3 * 10**12)}),
    "a bomb": archive({"state.json": head(), "0.npy": npy_file(np.zeros(1 << 20))}, zipfile.ZIP_DEFLATED),
    "a code": archive({"state.json": head(), "0.npy": b"\x93NUMPY\x01\x00\x10\x00__import__('os')"}),
}


@pytest.mark.parametrize("name", HOSTILE)
def test_what_is_no_state_is_one_line(name: str, tmp_path: Path) -> None:
    path = tmp_path / "light"
    path.write_bytes(HOSTILE[name])
    with pytest.raises(UserError, match=r"light: (is damaged|was written by another version)") as error:
        read_state(path)
    assert "\n" not in str(error.value)


def test_no_file(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="light: does not exist"):
        read_state(tmp_path / "light")


def test_arrays_are_asked_for_by_shape_and_type() -> None:
    state = some_state()
    assert state.array("image", np.float16, 2, -1, 4).shape == (2, 3, 4)
    for dtype, shape in ((np.float32, (2, 3, 4)), (np.float16, (2, 3)), (np.float16, (3, 3, 4))):
        with pytest.raises(StateError, match="image is float16"):
            state.array("image", dtype, *shape)
    with pytest.raises(StateError, match="other is missing"):
        state.array("other", np.float32)


@pytest.mark.parametrize("error", [KeyError("x"), ValueError("x"), TypeError("x"), IndexError("x")])
def test_whatever_does_not_fit_is_said_in_one_way(error: Exception) -> None:
    with pytest.raises(StateError, match="does not hold together"), fitting():
        raise error
