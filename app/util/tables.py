"""Tables as Markdown and CSV: rows are dictionaries, and columns say what of them is shown and how."""

from __future__ import annotations

import csv
import importlib.util
import io
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

Row = dict[str, Any]
FLIP = "flip_evaluator"  # see app/bench/flip.py


@dataclass(frozen=True)
class Column:
    """key: of the row; head: above the column in Markdown (CSV has the key); spec: format specification of its numbers; needs:
    a module of the extra ``bench`` without which there are none."""

    key: str
    head: str
    spec: str = ""
    needs: str | None = None

    def text(self, row: Row) -> str:
        """The cell; empty where the row has nothing."""
        value = row.get(self.key)
        return "" if value is None else value if isinstance(value, str) else format(value, self.spec)


def missing(module: str) -> str | None:
    """What to do about a module of the extra ``bench``; None if it is installed."""
    if importlib.util.find_spec(module) is not None:
        return None
    return f"needs {module.replace('_', '-')}: pip install 'glowtree[bench]'"


def markdown(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Cells aligned to the right."""
    lines = [list(head), ["---:"] * len(head), *(list(row) for row in rows)]
    widths = [max(len(cell) for cell in column) for column in zip(*lines, strict=True)]
    return "\n".join("| " + " | ".join(c.rjust(w) for c, w in zip(line, widths, strict=True)) + " |" for line in lines)


def markdown_table(columns: Sequence[Column], rows: Sequence[Row]) -> str:
    """The rows with every column's cell."""
    return markdown([c.head for c in columns], [[c.text(row) for c in columns] for row in rows])


def csv_text(columns: Sequence[Column], rows: Sequence[Row]) -> str:
    """The rows with all their digits under the columns' keys."""
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow([c.key for c in columns])
    writer.writerows([row.get(c.key) for c in columns] for row in rows)
    return out.getvalue()
