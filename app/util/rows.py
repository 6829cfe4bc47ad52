"""Numbers that are plotted as they come: columns by name, thinned so that they never grow without bound."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

CAPACITY = 4096  # rows kept: more than a plot has pixels


class Rows:
    """Columns of equal length, by name. When full, every second row goes."""

    def __init__(self, columns: tuple[str, ...]) -> None:
        self._columns = columns
        self._rows = np.zeros((CAPACITY, len(columns)))
        self._count = 0

    def append(self, *row: float) -> None:
        """One number for each column."""
        if self._count == CAPACITY:
            self._rows[: CAPACITY // 2] = self._rows[::2]
            self._count = CAPACITY // 2
        self._rows[self._count] = row
        self._count += 1

    @property
    def rows(self) -> NDArray[np.float64]:
        """(n, columns) f64."""
        return self._rows[: self._count].copy()

    @rows.setter
    def rows(self, rows: NDArray[np.float64]) -> None:
        self._count = len(rows)
        self._rows[: self._count] = rows

    def column(self, name: str) -> NDArray[np.float64]:
        """Contiguous (n,) f64."""
        return np.ascontiguousarray(self._rows[: self._count, self._columns.index(name)])
