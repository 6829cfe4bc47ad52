"""How a solve went: one row per report, thinned so that it never grows without bound."""

from __future__ import annotations

from app.util.rows import Rows

COLUMNS = ("shots", "seconds", "residual", "absorbed", "escaped")


class History(Rows):
    """Shots, seconds, residual [-], absorbed and escaped (shares of the emitted power)."""

    def __init__(self) -> None:
        super().__init__(COLUMNS)

    def add(self, shots: int, seconds: float, residual: float, escaped: float) -> None:
        """Append a row; what is neither unshot nor escaped was absorbed."""
        self.append(shots, seconds, residual, 1.0 - residual - escaped, escaped)

    @property
    def shots_per_second(self) -> float:
        """Over the last second of solving, or all of it."""
        rows = self._rows[: self._count]
        if len(rows) < 2:
            return 0.0
        recent = rows[rows[:, 1] >= rows[-1, 1] - 1.0]
        first = recent[0] if len(recent) > 1 else rows[-2]
        span = rows[-1, 1] - first[1]
        return float((rows[-1, 0] - first[0]) / span) if span > 0 else 0.0
