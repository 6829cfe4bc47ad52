"""What messages say of flags of the command line, in the words of the window."""

from __future__ import annotations

import re

from app.solvers import SOLVERS

FLAG = re.compile(r"--(?:no-)?([a-z][a-z-]*)")
SOLVER = re.compile(r"--solver (\w+)")
PLACES = {
    "light": "Ceiling in the Lights panel",
    "sky": "Sky in the Lights panel",
    "sun": "the sun's place in the Lights panel",
}


def plain(text: str) -> str:
    """``text``, with the name that a control has instead of its flag: "--solver gathering" is Gathering, "--density" Density."""
    text = SOLVER.sub(lambda found: SOLVERS[found[1]].title if found[1] in SOLVERS else found[0], text)
    return FLAG.sub(lambda found: PLACES.get(found[1]) or title(found[1].replace("-", "_")), text)


def title(name: str) -> str:
    """``shots_per_frame`` as a label: ``Shots per frame``."""
    words = name.replace("_", " ")
    return words[:1].upper() + words[1:]


__all__ = ["plain", "title"]
