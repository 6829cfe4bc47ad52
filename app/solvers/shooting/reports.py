"""A report tells the host what became of a batch, a few batches late: nothing waits for the GPU."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from app.gpu import Gpu, Pass, ReadBack
from app.scene.model import F64
from app.solvers.shooting.choose import Bins, Choice
from app.solvers.shooting.ledger import Ledger
from app.solvers.shooting.outside import Sent
from app.solvers.shooting.records import RECORDS, REPORT, SHOOTER
from app.solvers.shooting.shooters import ShooterBatch
from app.util.state import State

LAG = 2  # read-backs in flight before the oldest is looked at


@dataclass(frozen=True, eq=False)
class Report:
    """What became of a batch. choice: of its patches; none where it came from outside, or the
    choice is no more. values: REPORT; shooter: the first of the
    batch, SHOOTER. sent: how far light from outside was after it. escaped: what had left the scene
    when that was unshot which the report tells, RGB [stored units · solver area]."""

    choice: Choice | None
    values: np.void
    shooter: np.void
    sent: Sent
    escaped: F64


class Reports:
    """Those that are on their way. Whoever makes it releases it. escaped: what had left the scene after the last that arrived."""

    def __init__(self, gpu: Gpu) -> None:
        self._gpu = gpu
        self._texture = gpu.texture((REPORT.rows + SHOOTER.rows, 1), 4, "f4")
        self._target = gpu.target(self._texture)
        self._make = Pass(gpu, "solvers/shooting/report", slots=RECORDS)
        self.escaped = np.zeros(3)
        self._sent: deque[tuple[Choice | None, ReadBack, Sent]] = deque()

    def send(self, choice: Choice | None, bins: Bins, ledger: Ledger, shooters: ShooterBatch, sent: Sent) -> None:
        """Report a batch of this choice, and what was unshot before it; of one from outside, what is unshot after it."""
        self._make.draw(
            self._target,
            textures={
                "t_bins": bins.strongest,
                "t_unshot": bins.unshot,
                "t_ledger": ledger.texture,
                "t_shooters": shooters.texture,
            },
        )
        self._sent.append((choice, ReadBack.of(self._gpu, self._target), sent))

    def arrived(self, *, wait: bool) -> Iterator[Report]:
        """Those that have arrived, or with ``wait`` all."""
        while self._sent and (wait or len(self._sent) > LAG):
            choice, readback, sent = self._sent.popleft()
            texels = np.frombuffer(readback.take(), np.float32).reshape(-1, 4)
            values, shooter = REPORT.read(texels[: REPORT.rows])[0], SHOOTER.read(texels[REPORT.rows :])[0]
            before, self.escaped = self.escaped, values["escaped"].astype(np.float64)
            yield Report(choice, values, shooter, sent, self.escaped if choice is None else before)

    @property
    def all_arrived(self) -> bool:
        return not self._sent

    def drop(self) -> None:
        """Forget those on their way."""
        self.escaped = np.zeros(3)
        while self._sent:
            self._sent.popleft()[1].take()

    def state(self, choices: list[Choice]) -> State:
        """Those on their way, each of one of the choices, or of none of them; and what had left the scene after the last."""
        number = [-1 if choice is None or choice not in choices else choices.index(choice) for choice, *_ in self._sent]
        rows = [np.frombuffer(readback.look(), np.float32) for _, readback, _ in self._sent]
        return State(
            {"outside": [sent.values for *_, sent in self._sent]},
            {
                "choices": np.array(number, np.int64),
                "texels": np.array(rows, np.float32).reshape(-1, 4 * self._texture.width),
                "escaped": self.escaped.copy(),
            },
        )

    def restore(self, state: State, choices: list[Choice]) -> None:
        """Have those of a ``state`` on their way. Raises StateError."""
        self.drop()
        self.escaped = state.array("escaped", np.float64, 3)
        rows = state.array("texels", np.float32, -1, 4 * self._texture.width)
        numbers, outside = state.array("choices", np.int64, len(rows)).tolist(), state.values["outside"]
        for number, row, values in zip(numbers, rows, outside, strict=True):
            choice = choices[number] if number >= 0 else None
            self._sent.append((choice, ReadBack.arrived(self._gpu, row.tobytes()), Sent.of(values)))

    def release(self) -> None:
        self.drop()
        self._gpu.release_all(self._target, self._texture)
