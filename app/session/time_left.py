"""How much work there is time for until a solve is to end: pieces of work become smaller towards the end."""

from __future__ import annotations

NEAR_END = 2  # times as long as the last piece of work took: from there on the GPU is waited for


class TimeLeft:
    """Of a solve that has ``seconds``, whose solver works in groups of ``grain`` units."""

    def __init__(self, seconds: float, grain: int) -> None:
        self._seconds, self._grain = seconds, grain
        self._issued, self._now, self._last = 0, 0.0, 0.0
        self._each = 0.0  # seconds that a unit takes, by the last piece of work that issued any

    def piece(self, issued: int, now: float) -> None:
        """A piece of work is over: so much has been issued until now [s]."""
        more, self._last = issued - self._issued, now - self._now
        if more > 0:
            self._each = self._last / more
        self._issued, self._now = issued, now

    @property
    def near(self) -> bool:
        """Whether few pieces are left, so that each is to be timed well."""
        return self._seconds - self._now < NEAR_END * self._last

    @property
    def over(self) -> bool:
        """Whether the end is no farther than half a group."""
        return self._seconds - self._now <= self._grain * self._each / 2

    def room(self, most: int) -> int:
        """How much there is time for, to the nearest group; ``most`` while nothing is known."""
        if self._each == 0.0:
            return most
        groups = round((self._seconds - self._now) / self._each / self._grain)
        return min(max(groups, 1) * self._grain, most)
