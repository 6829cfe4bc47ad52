"""``glowtree`` and ``python -m app``."""

from __future__ import annotations

import os
import signal
import sys
from types import FrameType
from typing import NoReturn

from app.util.interrupt import end_as_by_ctrl_c, stopped


def main() -> None:
    """Run the command line. What is imported for it takes a moment, in which Ctrl-C ends it at once: nothing is open yet."""
    before = signal.getsignal(signal.SIGINT)
    if before is signal.default_int_handler:  # else it is ignored, as in a background job
        signal.signal(signal.SIGINT, _stop)
    from app.cli import run

    signal.signal(signal.SIGINT, before)
    end_as_by_ctrl_c()
    sys.exit(run(sys.argv[1:]))


def _stop(signal_number: int, frame: FrameType | None) -> NoReturn:
    """No exception: modules that are half imported would turn it into others."""
    os.write(2, f"{stopped(sys.argv[1:])}\n".encode())
    os._exit(130)


if __name__ == "__main__":
    main()
