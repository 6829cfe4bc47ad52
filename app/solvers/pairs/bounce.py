"""A bounce is one pass of Jacobi's iteration, H' = F (E + ρH), in parts that each take a fiftieth of a second.

Bands of texels gather from blocks of senders; a band is shown as soon as it is whole. What is left of a bounce waits until
more of it is asked for.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator

from app.gpu import Framebuffer, Gpu, Texture
from app.lightmap.lightmap import Lightmap
from app.solvers.pairs.gather import Area, gather_of
from app.solvers.pairs.kept import WORD
from app.solvers.pairs.occlusion import Scenes
from app.solvers.pairs.options import PairsOptions
from app.solvers.pairs.pace import Pace
from app.solvers.pairs.senders import Senders
from app.solvers.pairs.sent import Sent
from app.util.state import State, StateError

LEAST_SENDERS = 256  # in a block, where a band can be narrower instead


class Bounce:
    """Bounces of one lightmap by one choice of options. Whoever makes it releases it.

    pairs: that a bounce looks at, texels times choices. share: of the bounce under way that is done. at: row, rows of the band
    and choice at which it goes on; None where none is under way.
    """

    def __init__(self, gpu: Gpu, lightmap: Lightmap, scenes: Scenes, options: PairsOptions, pace: Pace) -> None:
        self._lightmap, self._options, self._pace = lightmap, options, pace
        self.senders = Senders(gpu, lightmap.pool, options)
        self._sent = Sent(gpu, lightmap, self.senders, merged=options.senders == "quadtree")
        self._gather, self.kept = gather_of(gpu, lightmap, self.senders, scenes, options)
        self.pairs = self.senders.table.count * self._gather.choices
        self.share = 0.0
        self.at: tuple[int, int, int] | None = None

    def run(
        self,
        target: Framebuffer,
        received: Texture,
        mean: float,
        bounce: int,
        *,
        begin: Callable[[], None],
        show: Callable[[Area], None],
    ) -> Iterator[None]:
        """The bounce of this number into a target, from what texels have received, in parts. mean: B̄ over all surfaces [stored
        units]. begin: writes what the target holds before. show: called with each band of the target that is whole. One that is
        under way goes on where it is."""
        if self.kept is not None:
            filled = self.kept.full
            yield from self.kept.fill(self._pace)
            if not filled:
                self._pace.forget()  # to look a bit up costs less than to find it
        yield from self._sent.draw(received, mean, self._options.merge)
        width, height = self._lightmap.size
        choices = self._gather.choices
        if self.at is None:
            begin()
            self.at = 0, self._rows_from(0), 0
        row, rows, first = self.at
        while row < height:
            area = 0, row, width, rows
            while first < choices:
                count = min(max(self._pace.pairs // (width * rows), 1), self._gather.most, choices - first)
                with self._pace.timed(width * rows * count):
                    self._gather.draw(target, self._sent.textures, area, first, count, bounce)
                first += count
                self.share = (row + rows * first / choices) / height
                self.at = row, rows, first
                yield
            show(area)
            row, first = row + rows, 0
            rows = self._rows_from(row)
        self.at, self.share = None, 0.0

    def _rows_from(self, row: int) -> int:
        """How many rows the band has that begins there."""
        width, height = self._lightmap.size
        least = min(LEAST_SENDERS, self._gather.choices)
        return height if self._gather.whole else min(max(self._pace.pairs // (width * least), 1), height - row)

    def state(self) -> State:
        """Where the bounce under way is, and what is known of pairs."""
        state = State({"at": self.at})
        if self.kept is not None:
            state.put("kept", self.kept.state())
        return state

    def restore(self, state: State) -> None:
        """Go on as from a ``state``; the target holds what it has so far. Raises StateError."""
        if (at := state.values["at"]) is not None:
            row, rows, first = map(int, at)
            if not (0 <= row and 0 < rows and row + rows <= self._lightmap.size[1] and 0 <= first):
                raise StateError(f"a bounce that is at row {row}")
            self.at = row, rows, first
        if self.kept is not None:
            self.kept.restore(state.part("kept"))

    @property
    def foreseen(self) -> float | None:
        """Seconds that a whole bounce takes, without what is kept from one to the next; None before enough of it was measured."""
        width, height = self._lightmap.size
        return self._pace.foreseen(width * height * self._gather.choices)

    @property
    def kept_pairs(self) -> int:
        """Of which a bit is kept."""
        return 0 if self.kept is None else self.kept.words * WORD

    def release(self) -> None:
        if self.kept is not None:
            self.kept.release()
        for part in (self._gather, self._sent, self.senders):
            part.release()
