"""How a solve went: one row for each progress that was heard of."""

from __future__ import annotations

from app.util.rows import Rows

COLUMNS = ("work", "seconds", "remaining", "absorbed", "escaped")


class History(Rows):
    """Work in the solver's unit, seconds, what remains [-], absorbed and escaped (shares of the emitted power)."""

    def __init__(self) -> None:
        super().__init__(COLUMNS)

    def add(self, work: int, seconds: float, remaining: float, escaped: float) -> None:
        """Append a row; what neither remains nor escaped was absorbed."""
        self.append(work, seconds, remaining, 1.0 - remaining - escaped, escaped)

    def work_per_second(self, until: float = 0.0) -> float:
        """Over the last second of solving and what began before it, or all of it. until: seconds of solving by now, where no
        progress was heard of for a while."""
        rows = self._rows[: self._count]
        if len(rows) < 2:
            return 0.0
        end, before = max(float(rows[-1, 1]), until), rows[:-1]
        older = before[before[:, 1] <= end - 1.0]
        first = older[-1] if len(older) else rows[0]
        span = end - first[1]
        return float((rows[-1, 0] - first[0]) / span) if span > 0 else 0.0
