"""The tree of boxes holds every triangle once, in boxes that it does not leave, and costs what a slow and obvious build costs."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from app.scene import shapes
from app.scene.model import F64
from app.visibility.bvh import DEEPEST, LEAF, STEP, Bvh, build_bvh
from app.visibility.bvh_table import node_table

BINS = 16


def soup(rng: np.random.Generator, count: int) -> F64:
    return rng.random((count, 1, 3)) + rng.normal(size=(count, 3, 3)) * 0.5 / max(count, 1) ** (1 / 3)


def ball(subdivisions: int) -> F64:
    mesh = shapes.icosphere(1.0, subdivisions)
    return mesh.positions[mesh.triangles]


def room(rng: np.random.Generator) -> F64:
    """Large walls, and heaps of small triangles in it."""
    heaps = [0.02 * soup(rng, 200) + rng.random(3) for _ in range(4)]
    return np.concatenate([np.array(shapes.box((1, 1, 1)).positions)[shapes.box((1, 1, 1)).triangles] + 0.5, *heaps])


def corridor(rng: np.random.Generator) -> F64:
    """Most of it near one end."""
    corners = soup(rng, 800)
    return (corners - corners[:, :1]) * 0.01 + corners[:, :1] ** [12, 1, 6]


SCENES = {"soup": lambda rng: soup(rng, 800), "ball": lambda rng: ball(3), "room": room, "corridor": corridor}


def leaves_of(bvh: Bvh) -> list[tuple[int, int, F64, int]]:
    """Of each leaf: first slot, triangles, the box (2, 3) in its parent, levels above."""
    found, todo = [], [(0, 1, np.array([[-np.inf] * 3, [np.inf] * 3]))]
    while todo:
        node, level, outer = todo.pop()
        for lower, upper in bvh.nodes[node].astype(np.float64).reshape(2, 2, 4):
            reference, count = int(lower[3]), int(upper[3])
            box = np.stack([lower[:3], upper[:3]])
            if reference >= 0:
                assert (box[0] >= outer[0]).all() and (box[1] <= outer[1]).all(), "a box leaves its parent's"
            if count:
                found.append((reference, count, box, level))
            elif reference >= 0:
                assert reference > node
                todo.append((reference, level + 1, box))
    return found


def check(bvh: Bvh, corners: F64) -> None:
    count = len(corners)
    assert sorted(bvh.order.tolist()) == list(range(count))
    leaves = leaves_of(bvh)
    slots = [slot for first, many, _, _ in leaves for slot in range(first, first + many)]
    assert sorted(slots) == list(range(count))
    for first, many, box, _ in leaves:
        assert 1 <= many <= LEAF
        inside = corners[bvh.order[first : first + many]]
        assert (inside > box[0]).all() and (inside < box[1]).all(), "boxes have a margin"
    assert bvh.depth == max((level for *_, level in leaves), default=1) <= DEEPEST


@pytest.mark.parametrize("count", [0, 1, 2, 3, 4, 5, 17, 1000])
def test_every_triangle_is_in_one_leaf(rng: np.random.Generator, count: int) -> None:
    corners = soup(rng, count)
    check(build_bvh(corners), corners)


def degenerate(rng: np.random.Generator, kind: str) -> F64:
    one = soup(rng, 1)
    return {
        "the same": np.repeat(one, 500, 0),
        "points": np.repeat(rng.random((500, 1, 3)), 3, 1),
        "lines": rng.random((500, 3, 1)) * np.ones(3),
        "in a plane": soup(rng, 500) * [1, 1, 0],
        "far away": soup(rng, 500) + 1e6,
        # each a third as far as the one before: bins part one from all others, level by level
        "ever nearer": one * 3.0 ** -np.arange(60)[:, None, None],
        "halved": np.concatenate([one * 1.9 ** -np.arange(200)[:, None, None], np.repeat(one * 0, 300, 0)]),
    }[kind]


@pytest.mark.parametrize("kind", ["the same", "points", "lines", "in a plane", "far away", "ever nearer", "halved"])
def test_triangles_that_no_place_parts(rng: np.random.Generator, kind: str) -> None:
    corners = degenerate(rng, kind)
    bvh = build_bvh(corners)
    check(bvh, corners)
    assert np.isfinite(bvh.cost) and np.isfinite(bvh.nodes).all()


@pytest.mark.parametrize("kind", ["soup", "ball", "room"])
def test_cells_hold_the_boxes(rng: np.random.Generator, kind: str) -> None:
    corners = SCENES[kind](rng) - 0.5
    bvh = build_bvh(corners)
    table, gridded = node_table(bvh)
    assert gridded and table.shape == (len(bvh.nodes) + 1, 2, 4)
    corner, cells = table[0, :, :3].view(np.float32).astype(np.float64)
    box = [corner + part.astype(np.float64) / cells for part in (table[1:, :, :3] & 0xFFFF, table[1:, :, :3] >> 16)]
    assert (box[0] < bvh.nodes[:, ::2, :3]).all() and (box[1] > bvh.nodes[:, 1::2, :3]).all()
    assert (box[0] > bvh.nodes[:, ::2, :3] - 1.1 / cells).all() and (
        box[1] < bvh.nodes[:, 1::2, :3] + 1.1 / cells
    ).all()


# -- the slow build ----------------------------------------------------------------------------------------------------


def area(boxes: F64) -> float:
    """Half the surface of the box around boxes (n, 2, 3)."""
    x, y, z = boxes[:, 1].max(0) - boxes[:, 0].min(0)
    return float(x * y + y * z + z * x)


def slow_cost(boxes: F64) -> float:
    """Cost of a tree over boxes (n, 2, 3), times the area of all: each node parted at the best of all bins of all axes."""
    whole, best, parted = area(boxes), np.inf, None
    if len(boxes) == 1:
        return whole
    centres = boxes.mean(1)
    for axis in range(3):
        lower, upper = centres[:, axis].min(), centres[:, axis].max()
        for place in np.linspace(lower, upper, BINS + 1)[1:-1]:
            left: NDArray[np.bool_] = centres[:, axis] < place
            if left.all() or not left.any():
                continue
            cost = area(boxes[left]) * left.sum() + area(boxes[~left]) * (~left).sum()
            if cost < best:
                best, parted = cost, left
    if parted is None:
        parted = np.arange(len(boxes)) < len(boxes) // 2
    elif len(boxes) <= LEAF and whole * STEP + best >= whole * len(boxes):
        return whole * len(boxes)
    return whole * STEP + slow_cost(boxes[parted]) + slow_cost(boxes[~parted])


@pytest.mark.parametrize("kind", SCENES)
def test_it_costs_what_a_slow_build_costs(rng: np.random.Generator, kind: str) -> None:
    """Within a tenth; that cost is the tree's own."""
    corners = SCENES[kind](rng)
    boxes = np.stack([corners.min(1), corners.max(1)], 1)
    bvh = build_bvh(corners)
    assert bvh.cost <= 1.1 * slow_cost(boxes) / area(boxes)
    inner = bvh.nodes[:, 1::2, 3] == 0
    size = (bvh.nodes[:, 1::2, :3] - bvh.nodes[:, ::2, :3]).astype(np.float64)
    areas = size[..., 0] * size[..., 1] + size[..., 1] * size[..., 2] + size[..., 2] * size[..., 0]
    cost = STEP + (areas * np.where(inner, STEP, bvh.nodes[:, 1::2, 3])).sum() / area(boxes)
    assert bvh.cost == pytest.approx(cost, rel=1e-3)


# -- in the background -------------------------------------------------------------------------------------------------


def test_it_says_how_far_it_is_and_can_be_stopped(rng: np.random.Generator) -> None:
    told: list[float] = []
    corners = soup(rng, 5000)
    build_bvh(corners, told.append)
    assert told == sorted(told) and told[-1] == 1.0 and len(told) > 5
    assert told[0] == 0.0 and 0.3 < told[len(told) // 2] < 0.9, "each level is about as much work as any other"

    def stop(share: float) -> None:
        raise InterruptedError

    with pytest.raises(InterruptedError):
        build_bvh(corners, stop)
