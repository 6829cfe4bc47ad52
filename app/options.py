"""One declared field = default, unit, range and help; the command line flag, the widget and the report follow from it.

    @dataclass(frozen=True)
    class ShootingOptions(Options):
        level: int = option(2, "mip level that shoots, above the texels", minimum=0, maximum=4)

An ``Options`` checks itself when made: a value out of range raises ``UserError`` with name, value and what is allowed.
"""

from __future__ import annotations

import argparse
import dataclasses
import functools
import math
import types
import typing
from collections.abc import Callable, Container, Mapping
from dataclasses import dataclass
from typing import Any, Self, TypeVar

from app.errors import UserError

OptionsT = TypeVar("OptionsT", bound="Options")


@dataclass(frozen=True)
class Spec:
    """What is known of one option: enough for a flag, a widget and a line of the report."""

    name: str
    type: type
    default: Any
    help: str
    unit: str = ""
    minimum: float | None = None
    maximum: float | None = None
    choices: tuple[str, ...] | tuple[int, ...] = ()
    logarithmic: bool = False
    multiple: int = 1
    optional: bool = False
    zero: str = ""
    usual: tuple[float, float] | None = None
    label: str = ""
    tip: str = ""
    term: str = ""
    off: Callable[[Any], str | None] | None = None

    @property
    def title(self) -> str:
        """What a widget is called: ``Frame budget`` for frame_budget, where nothing else was declared."""
        words = self.name.replace("_", " ")
        return self.label or words[:1].upper() + words[1:]

    @property
    def flag(self) -> str:
        return "--" + self.name.replace("_", "-")

    @property
    def allowed(self) -> str:
        """The legal values in words, e.g. ``0 to 4``."""
        if self.multiple > 1:
            return f"{self.minimum:g} to {self.maximum:g} in steps of {self.multiple}"
        if self.choices:
            return "one of " + ", ".join(map(str, self.choices))
        if self.minimum is not None and self.maximum is not None:
            return f"{self._text(self.minimum)} to {self._text(self.maximum)}"
        if self.minimum is not None:
            return f"at least {self._text(self.minimum)}"
        if self.maximum is not None:
            return f"at most {self._text(self.maximum)}"
        return {int: "a whole number", float: "a number", bool: "true or false"}.get(self.type, "text")

    def _text(self, bound: float) -> str:
        return str(int(bound)) if self.type is int else f"{bound:g}"

    def check(self, value: Any) -> None:
        """Raise UserError unless ``value`` is legal."""
        if value is None and self.optional:
            return
        number = self.type in (int, float)
        legal = (
            isinstance(value, (int, float)) and not isinstance(value, bool) if number else isinstance(value, self.type)
        )
        if legal and self.type is int:
            legal = float(value).is_integer()
        if legal and number:
            legal = math.isfinite(value)
            legal = legal and (self.minimum is None or value >= self.minimum)
            legal = legal and (self.maximum is None or value <= self.maximum)
            legal = legal and (self.multiple == 1 or value % self.multiple == 0)
        if legal and self.choices:
            legal = value in self.choices
        if not legal:
            raise UserError(f"{self.flag} {value}: must be {self.allowed}")


def option(
    default: Any,
    help: str,
    *,
    unit: str = "",
    minimum: float | None = None,
    maximum: float | None = None,
    choices: typing.Iterable[str] | typing.Iterable[int] = (),
    logarithmic: bool = False,
    multiple: int = 1,
    zero: str = "",
    usual: tuple[float, float] | None = None,
    label: str = "",
    tip: str = "",
    term: str = "",
    off: Callable[[Any], str | None] | None = None,
) -> Any:
    """Declare one field of an ``Options`` dataclass. help: for the flag. zero: what a widget shows instead of 0. usual: ends of a
    widget's range, inside of what is legal. label: of the widget, where it is not the name. tip: what the option does for the
    picture and what it costs, for the widget's tooltip; help where that says it. term: what papers call it. off: why the option
    has no effect, given all options of the class, or None where it has one."""
    meta = {"help": help, "unit": unit, "minimum": minimum, "maximum": maximum, "choices": tuple(choices)}
    return dataclasses.field(
        default=default,
        metadata={
            **meta,
            **{"logarithmic": logarithmic, "multiple": multiple, "zero": zero, "usual": usual},
            **{"label": label, "tip": tip, "term": term, "off": off},
        },
    )


def only_with(name: str, values: Container[Any], reason: str) -> Callable[[Any], str | None]:
    """The ``off`` of an option that has an effect only where the option ``name`` is one of ``values``."""
    return lambda options: None if getattr(options, name) in values else reason


@dataclass(frozen=True)
class Options:
    """Base of every set of knobs: frozen, checked when made, edited by ``replace``."""

    def __post_init__(self) -> None:
        for spec in specs(type(self)):
            spec.check(getattr(self, spec.name))

    def replace(self, **changes: Any) -> Self:
        """A checked copy with some fields changed, or itself where they are as they were; an unknown name is an error."""
        own = {spec.name for spec in specs(type(self))}
        unknown = changes.keys() - own
        if unknown:
            raise UserError(f"unknown option {', '.join(sorted(unknown))} for {type(self).__name__}")
        same = all(getattr(self, name) == value for name, value in changes.items())
        return self if same else dataclasses.replace(self, **changes)

    def as_dict(self) -> dict[str, Any]:
        return dataclasses.asdict(self)


def specs(options: type[Options]) -> list[Spec]:
    """The declared options of a class, in order."""
    hashable: Any = options
    return _specs(hashable)


@functools.cache
def _specs(options: Any) -> list[Spec]:
    hints = typing.get_type_hints(options)
    out = []
    for f in dataclasses.fields(options):
        kind, optional = hints[f.name], False
        if isinstance(kind, types.UnionType):
            kind = next(a for a in typing.get_args(kind) if a is not type(None))
            optional = True
        out.append(Spec(f.name, kind, f.default, optional=optional, **f.metadata))
    return out


def add_flags(
    parser: argparse.ArgumentParser,
    options: type[Options],
    *,
    only: Container[str] | None = None,
    defaults: Mapping[str, Any] | None = None,
) -> None:
    """Give ``parser`` one flag per declared option, or for some ``only``; booleans become ``--name`` / ``--no-name``. defaults:
    other ones than those declared, by name, that ``from_flags`` is given, too."""
    own = defaults or {}
    group = parser.add_argument_group(options.__name__.removesuffix("Options").lower())
    for spec in specs(options):
        if only is not None and spec.name not in only:
            continue
        unit = f" [{spec.unit}]" if spec.unit else ""
        value = own.get(spec.name, spec.default)
        default = "" if value is None else f" (default {value})"
        text = (spec.help + unit + default).replace("%", "%%")
        if spec.type is bool:
            group.add_argument(spec.flag, action=argparse.BooleanOptionalAction, default=None, help=text)
        else:
            meta = "{" + ",".join(map(str, spec.choices)) + "}" if spec.choices else spec.type.__name__.upper()
            group.add_argument(spec.flag, type=_reader(spec), metavar=meta, help=text)


def from_flags(
    options: type[OptionsT], flags: argparse.Namespace, defaults: Mapping[str, Any] | None = None
) -> OptionsT:
    """The options that the parsed flags ask for; flags not given keep the default. defaults: as of ``add_flags``."""
    own = defaults or {}
    given = {s.name: getattr(flags, s.name, None) for s in specs(options)}
    values = {name: own.get(name) if value is None else value for name, value in given.items()}
    return options(**{name: value for name, value in values.items() if value is not None})


def _reader(spec: Spec) -> Any:
    def read(text: str) -> Any:
        try:
            value = spec.type(text)
        except ValueError:
            raise argparse.ArgumentTypeError(f"{text}: must be {spec.allowed}") from None
        try:
            spec.check(value)
        except UserError:
            raise argparse.ArgumentTypeError(f"{text}: must be {spec.allowed}") from None
        return value

    return read
