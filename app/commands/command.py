"""What a word after ``glowtree`` does, and how a parser is told of it."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Mapping
from typing import NamedTuple

from app.commands.flags import Parser
from app.solvers import Family

# Where nobody names a solver: shooting is what there is to watch; gathering is at 2 % first in every scene, by `bench error`,
# and made to be edited.
SOLVER_OF = {"bake": "gathering", "bench edits": "gathering"}


class Command(NamedTuple):
    """What a word after ``glowtree`` does. flags: adds its own, and those of a solver, to a parser. run: with them, returns the
    exit code; none where another word follows."""

    help: str
    flags: Callable[[Parser, Family], None]
    run: Callable[[argparse.Namespace], int] | None = None


def add_commands(parser: Parser, what: str, commands: Mapping[str, Command], family: Family) -> None:
    """One subparser for each word. what: such a word is called so in the usage; family: the solver whose flags are known."""
    words = parser.add_subparsers(required=True, metavar=what, parser_class=Parser)
    for word, command in commands.items():
        own = words.add_parser(word, help=command.help, description=command.help[0].upper() + command.help[1:] + ".")
        command.flags(own, family)
        if command.run:
            own.set_defaults(command=command.run)
