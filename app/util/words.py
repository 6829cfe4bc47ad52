"""Words of notes and names: counted, and on one line."""

from __future__ import annotations


def counted(count: int, one: str, many: str) -> str:
    """``1 triangle`` or ``3 triangles``."""
    return f"{count} {one if count == 1 else many}"


def one_line(text: str) -> str:
    """``text`` as a single line without control characters: names in files can hold anything."""
    return " ".join("".join(c if c.isprintable() else " " for c in text).split())
