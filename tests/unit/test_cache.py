"""Answers that are kept on disk: whole or not at all, also where another thread writes them."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from app.util import cache
from app.util.background import CancelledError

ARRAYS = {"numbers": np.arange(12.0).reshape(3, 4), "words": np.array(["a", "bc"]), "one": np.array(True)}


@pytest.fixture(autouse=True)
def folder(tmp_path: Path) -> Iterator[Path]:
    with cache.elsewhere(tmp_path / "cache"):
        yield tmp_path / "cache"


def _same(one: cache.Arrays | None, other: cache.Arrays) -> bool:
    return (
        one is not None and one.keys() == other.keys() and all(np.array_equal(one[name], other[name]) for name in one)
    )


@pytest.mark.parametrize("beside", [False, True])
def test_what_is_kept_is_read_again_and_of_it_the_newest(folder: Path, beside: bool) -> None:
    files = [cache.entry("kind", name) for name in "abc"]
    if beside:
        with cache.written_beside() as failures:
            for file in files:
                cache.store(lambda: ARRAYS, file, 2)
        assert failures == []
    else:
        for file in files:
            cache.store(ARRAYS, file, 2)
    assert _same(cache.read(files[2]), ARRAYS)
    assert len([*(folder / "kind").iterdir()]) == 2


def test_who_cancels_does_not_wait_and_half_a_file_is_none(folder: Path) -> None:
    begun, stopped = threading.Event(), threading.Event()
    writers: list[threading.Thread] = []

    class Slow:
        """The second array, which takes until the other thread has left."""

        def __array__(self, dtype: object = None, copy: object = None) -> np.ndarray:
            writers.append(threading.current_thread())
            begun.set()
            assert stopped.wait(20)
            return np.zeros(3)

    with pytest.raises(CancelledError), cache.written_beside() as failures:
        cache.store({"first": np.zeros(9), "slow": Slow(), "last": np.zeros(9)}, cache.entry("kind", "a"), 2)  # type: ignore[dict-item]
        cache.store(ARRAYS, cache.entry("kind", "b"), 2)
        assert begun.wait(20)
        raise CancelledError
    assert writers[0].is_alive(), "waited for"
    stopped.set()
    writers[0].join(20)
    assert [*(folder / "kind").iterdir()] == [] and failures == []


@pytest.mark.parametrize("beside", [False, True])
def test_a_disk_that_fails_is_said(folder: Path, beside: bool) -> None:
    """Whichever thread keeps something."""
    folder.mkdir()
    (folder / "kind").write_text("no folder")
    with cache.written_beside() as failures:
        if beside:
            cache.store(ARRAYS, cache.entry("kind", "a"), 2)
        else:
            thread = threading.Thread(target=cache.store, args=(ARRAYS, cache.entry("kind", "a"), 2))
            thread.start()
            thread.join()
    assert failures == [f"{folder}: File exists"]


def test_a_bug_in_what_is_kept_is_raised() -> None:
    def broken() -> cache.Arrays:
        raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError), cache.written_beside():
        cache.store(broken, cache.entry("kind", "a"), 2)


def test_it_can_be_entered_twice() -> None:
    with cache.written_beside():
        with cache.written_beside():
            cache.store(ARRAYS, cache.entry("kind", "inner"), 4)
        assert _same(cache.read(cache.entry("kind", "inner")), ARRAYS)
        cache.store(ARRAYS, cache.entry("kind", "outer"), 4)
    assert _same(cache.read(cache.entry("kind", "outer")), ARRAYS)
