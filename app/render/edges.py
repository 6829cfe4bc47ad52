"""Where leaves meet leaves of another level: the border texels there are not copies, see app/shaders/render/edges.frag.glsl."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from app.atlas.node_set import NodeSet
from app.atlas.quadtree import SIDES
from app.scene.model import F32

EDGE_FORMAT = {"in_rect": "4f", "in_outward": "2f"}
CORNERS = ((-1, -1), (1, -1), (-1, 1), (1, 1))
Ints = NDArray[np.int64]


def unequal_edges(nodes: NodeSet, border: int) -> dict[bool, F32]:
    """(n, 6) f32 instances of EDGE_FORMAT, by whether they follow: half edges beside a coarser leaf; half edges beside a finer
    one, and corners. They are rectangles of display texels, whose tiles have a border of so many texels."""
    if nodes.depth == 0:
        return {}
    slots = np.flatnonzero(nodes.used)
    level = nodes.leaves.level[slots]
    pages = np.pad(nodes.slot_tables["t_pages"][..., 0].astype(np.int64), 1)
    side = 1 << (nodes.depth - level.astype(np.int64))  # pages along an edge of each leaf
    left, bottom = nodes.leaves.x[slots] * side + 1, nodes.leaves.y[slots] * side + 1
    corner = np.stack([slots % nodes.columns, slots // nodes.columns], 1) * (nodes.tile + 2 * border)
    found: dict[bool, list[NDArray[np.float64]]] = {False: [], True: []}
    for outward, half in _parts():
        x, y = (_page(d, h, side) for d, h in zip(outward, half, strict=True))
        near = pages[bottom + y, left + x] - 1
        finer = np.where(near >= 0, nodes.leaves.level[near] - level, 0)
        (place_x, width), (place_y, height) = (
            _span(d, h, nodes.tile, border) for d, h in zip(outward, half, strict=True)
        )
        for follows in (False, True):
            unequal = finer != 0 if all(outward) else finer < 0 if follows else finer > 0
            which = np.flatnonzero(unequal & (not (follows and all(outward))))
            rest = np.tile([width, height, *outward], (len(which), 1))
            found[follows].append(np.column_stack([corner[which] + (place_x, place_y), rest]))
    return {
        follows: np.concatenate(parts).astype(np.float32) for follows, parts in found.items() if sum(map(len, parts))
    }


def _parts() -> Iterator[tuple[tuple[int, int], tuple[int, int]]]:
    """Half edges and corners: outward along u and v, and which half along the axis that does not lead outward."""
    for dx, dy in SIDES:
        for half in (0, 1):
            yield (dx, dy), (half * (dx == 0), half * (dy == 0))
    for outward in CORNERS:
        yield outward, (0, 0)


def _page(outward: int, half: int, side: Ints) -> Ints:
    """Along one axis, the page beyond each leaf, or the one in the middle of a half of it; from its first page on."""
    if outward:
        return side if outward > 0 else np.full_like(side, -1)
    return side // 4 + half * (side // 2)


def _span(outward: int, half: int, tile: int, border: int) -> tuple[int, int]:
    """Along one axis, first and number of the display texels of a tile."""
    if outward:
        return (border + tile if outward > 0 else 0), border
    return border + half * (tile // 2), tile // 2
