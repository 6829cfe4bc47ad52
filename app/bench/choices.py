"""What is asked of a measurement: names given to a flag with commas between them, such as ``--methods uniform,disc``, and its own
defaults."""

from __future__ import annotations

import argparse
from collections.abc import Iterable

CURVES_END = {"noise": 1e-3}  # of `bench error`: later than a bake, for what a method comes to


def chosen_names(text: str, known: Iterable[str]) -> tuple[str, ...]:
    """Each once, in the order given; ``all`` stands for all that are known. Raises ArgumentTypeError for one that is not."""
    known = tuple(known)
    names = known if text == "all" else tuple(dict.fromkeys(text.split(",")))
    for name in names:
        if name not in known:
            raise argparse.ArgumentTypeError(f"{name}: must be all, or some of {', '.join(known)}")
    return names
