"""Trees of many triangles are read from the cache; a file that holds no such tree is made anew; threads build a tree once."""

from __future__ import annotations

import threading
import time
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

import app.visibility.bvh_cache as bvh_cache
import app.visibility.rays as rays
from app.scene import shapes
from app.scene.model import F64
from app.util import cache
from app.visibility.bvh import Bvh, build_bvh
from app.visibility.bvh_cache import FEWEST, bvh_of

BALL = shapes.icosphere(1.0, 4)
CORNERS = BALL.positions[BALL.triangles]
assert len(CORNERS) >= FEWEST


@pytest.fixture(autouse=True)
def own_cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setattr("platformdirs.user_cache_dir", lambda name: str(tmp_path))
    return tmp_path


@pytest.fixture
def builds(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """How many triangles each tree is built of from now on."""
    counts: list[int] = []

    def counting(corners: F64, *tell: object) -> Bvh:
        counts.append(len(corners))
        return build_bvh(corners, *tell)

    monkeypatch.setattr(bvh_cache, "build_bvh", counting)
    return counts


def same(one: Bvh, other: Bvh) -> bool:
    return all(np.array_equal(getattr(one, name), getattr(other, name)) for name in vars(one))


def test_a_tree_is_built_once_and_then_read(own_cache: Path, builds: list[int]) -> None:
    first, second = bvh_of(CORNERS), bvh_of(CORNERS.copy())
    assert builds == [len(CORNERS)] and first is not second
    assert same(first, second) and same(second, build_bvh(CORNERS))
    assert {name: (type(v), getattr(v, "dtype", None)) for name, v in vars(first).items()} == {
        name: (type(v), getattr(v, "dtype", None)) for name, v in vars(second).items()
    }
    moved = CORNERS.copy()
    moved[17, 1, 2] += 1e-6
    bvh_of(moved)
    assert len(builds) == 2, "one corner is elsewhere"
    assert len(list((own_cache / "bvh").iterdir())) == 2


def test_another_builder_makes_other_files(builds: list[int], monkeypatch: pytest.MonkeyPatch) -> None:
    bvh_of(CORNERS)
    monkeypatch.setattr(bvh_cache, "FORMAT", b"another")
    bvh_of(CORNERS)
    assert len(builds) == 2


def test_few_triangles_need_no_file(own_cache: Path) -> None:
    bvh_of(CORNERS[: FEWEST - 1])
    assert not (own_cache / "bvh").exists()


def damaged(kind: str, file: Path) -> None:
    """Make a file of the cache one that holds no tree of CORNERS."""
    whole, data = file.read_bytes(), dict(np.load(file))
    nodes, inner = data["nodes"], np.argwhere((data["nodes"][:, ::2, 3] > 0) & (data["nodes"][:, 1::2, 3] == 0))
    node, side = inner[5]
    if kind == "half":
        file.write_bytes(whole[: len(whole) // 2])
    elif kind == "a flipped bit":
        at = len(whole) // 3
        file.write_bytes(whole[:at] + bytes([whole[at] ^ 4]) + whole[at + 1 :])
    elif kind == "empty":
        file.write_bytes(b"")
    elif kind == "too shallow":
        np.savez(file, **(data | {"depth": data["depth"] - 1}))
    elif kind == "one array":
        with file.open("wb") as out:
            np.save(out, nodes)
    elif kind == "of other triangles":
        other = build_bvh(CORNERS[:-1])
        cache.write(file, {name: np.asarray(value) for name, value in vars(other).items()})
    else:
        if kind == "a triangle twice":
            data["order"][7] = data["order"][8]
        elif kind == "a circle":
            nodes[node, 2 * side, 3] = 0
        elif kind == "a leaf too long":
            leaf = np.argwhere(nodes[:, 1, 3] > 0)[3, 0]
            nodes[leaf, 1, 3] += 1
        elif kind == "no numbers":
            nodes[3, 0, 0] = np.nan
        elif kind == "doubles":
            data["nodes"] = nodes.astype(np.float64)
        cache.write(file, data)


@pytest.mark.parametrize(
    "kind",
    [
        *("half", "a flipped bit", "empty", "one array", "of other triangles"),
        *("a triangle twice", "a circle", "a leaf too long", "no numbers", "doubles", "too shallow"),
    ],
)
def test_a_file_that_holds_no_such_tree_is_made_anew(own_cache: Path, builds: list[int], kind: str) -> None:
    first = bvh_of(CORNERS)
    (file,) = (own_cache / "bvh").iterdir()
    whole = file.read_bytes()
    damaged(kind, file)
    assert file.read_bytes() != whole
    assert same(bvh_of(CORNERS), first) and len(builds) == 2
    assert same(bvh_of(CORNERS), first) and len(builds) == 2, "and is whole again"


def test_a_build_that_is_stopped_leaves_no_file(own_cache: Path, builds: list[int]) -> None:
    def stop(share: float) -> None:
        if share > 0.5:
            raise InterruptedError

    with pytest.raises(InterruptedError):
        bvh_of(CORNERS, stop)
    assert not list(own_cache.rglob("*"))
    bvh_of(CORNERS)
    assert len(builds) == 2


def test_the_newest_files_are_kept(own_cache: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(bvh_cache, "CACHE_FILES", 2)
    for size in (1.0, 2.0, 3.0):
        bvh_of(size * CORNERS)
    assert len(list((own_cache / "bvh").iterdir())) == 2


# -- of a tile pool, by many threads -----------------------------------------------------------------------------------


class Pool:
    """As much of a tile pool as its tree needs."""

    def __init__(self) -> None:
        self.space = SimpleNamespace(local_from_world=lambda points: points)
        self.scene = SimpleNamespace(positions=BALL.positions, triangles=BALL.triangles)


def test_two_threads_build_one_tree_and_both_say_how_far_it_is(monkeypatch: pytest.MonkeyPatch) -> None:
    pool, built, told, found = Pool(), [], [[], []], [None, None]
    go_on = threading.Event()

    def slow(corners: F64, tell: object) -> Bvh:
        tell(0.25)
        built.append(threading.get_ident())
        assert go_on.wait(20)
        return build_bvh(corners, tell)

    def ask(k: int) -> None:
        found[k] = rays.tree_of(pool, told[k].append)

    monkeypatch.setattr(bvh_cache, "build_bvh", slow)
    threads = [threading.Thread(target=ask, args=(k,)) for k in range(2)]
    for thread in threads:
        thread.start()
    while not all(told):
        time.sleep(0.01)
    assert not rays.tree_is_near(pool)
    go_on.set()
    for thread in threads:
        thread.join()
    assert len(built) == 1 and found[0] is found[1] is rays.tree_of(pool) and rays.tree_is_near(pool)
    assert told[0][0] == told[1][0] == 0.25


def test_who_waits_can_leave_and_another_pool_does_not_wait(monkeypatch: pytest.MonkeyPatch) -> None:
    pool, go_on, begun = Pool(), threading.Event(), threading.Event()

    def slow(corners: F64, tell: object) -> Bvh:
        begun.set()
        assert go_on.wait(20)
        return build_bvh(corners, tell)

    def leave(share: float) -> None:
        raise InterruptedError

    monkeypatch.setattr(bvh_cache, "build_bvh", slow)
    builder = threading.Thread(target=rays.tree_of, args=(pool,))
    builder.start()
    assert begun.wait(20)
    with pytest.raises(InterruptedError):
        rays.tree_of(pool, leave)
    monkeypatch.setattr(bvh_cache, "build_bvh", build_bvh)
    assert rays.tree_of(Pool()).depth > 5 and builder.is_alive()
    go_on.set()
    builder.join()


def test_after_a_build_that_was_stopped_the_next_one_builds() -> None:
    pool = Pool()

    def stop(share: float) -> None:
        raise InterruptedError

    with pytest.raises(InterruptedError):
        rays.tree_of(pool, stop)
    assert not rays.tree_is_near(pool)
    assert same(rays.tree_of(pool), build_bvh(rays.corners_of(pool)))
