"""One declared field makes default, check, flag and help; every set of options of the program is walked."""

from __future__ import annotations

import argparse
import math
from dataclasses import dataclass, fields
from typing import Any

import pytest

from app.atlas.options import AtlasOptions
from app.errors import UserError
from app.options import Options, Spec, add_flags, from_flags, option, specs
from app.render.options import DisplayOptions
from app.solvers import ShootingOptions

ALL = (AtlasOptions, ShootingOptions, DisplayOptions)
FIELDS = [(options, spec) for options in ALL for spec in specs(options)]


@dataclass(frozen=True)
class Sample(Options):
    count: int = option(3, "how many, 100 % of them", minimum=1, maximum=8)
    size: int = option(64, "edge", unit="px", minimum=32, maximum=128, multiple=32)
    gain: float = option(1.0, "factor", minimum=0.0)
    low: float = option(-1.0, "lowest", maximum=0.0)
    free: float = option(0.0, "any")
    quick: bool = option(False, "less exact")
    kind: str = option("a", "which", choices=("a", "b"))
    edge: int = option(8, "how wide", choices=(8, 16))
    limit: float | None = option(None, "unset: none", minimum=0.0)


# field, a legal value, an illegal one, and what is said of it
CASES = [
    ("count", 8, 9, "--count 9: must be 1 to 8"),
    ("count", 1, 0, "--count 0: must be 1 to 8"),
    ("count", 2, 2.5, "--count 2.5: must be 1 to 8"),
    ("count", 2, True, "--count True: must be 1 to 8"),
    ("count", 2, "2", "--count 2: must be 1 to 8"),
    ("count", 2, None, "--count None: must be 1 to 8"),
    ("size", 96, 65, "--size 65: must be 32 to 128 in steps of 32"),
    ("gain", 1e9, -0.1, "--gain -0.1: must be at least 0"),
    ("gain", 1, math.nan, "--gain nan: must be at least 0"),
    ("gain", 0, math.inf, "--gain inf: must be at least 0"),
    ("low", -5.0, 0.1, "--low 0.1: must be at most 0"),
    ("free", -1e9, "x", "--free x: must be a number"),
    ("quick", True, 1, "--quick 1: must be true or false"),
    ("kind", "b", "c", "--kind c: must be one of a, b"),
    ("edge", 16, 12, "--edge 12: must be one of 8, 16"),
    ("edge", 16, "16", "--edge 16: must be one of 8, 16"),
    ("limit", None, -1.0, "--limit -1.0: must be at least 0"),
    ("limit", 2.0, math.nan, "--limit nan: must be at least 0"),
]


@pytest.mark.parametrize(("name", "legal", "illegal", "said"), CASES, ids=[f"{c[0]}-{c[2]}" for c in CASES])
def test_a_set_of_options_checks_itself(name: str, legal: Any, illegal: Any, said: str) -> None:
    assert getattr(Sample(**{name: legal}), name) == legal
    for make in (lambda: Sample(**{name: illegal}), lambda: Sample().replace(**{name: illegal})):
        with pytest.raises(UserError) as error:
            make()
        assert str(error.value) == said


def test_replace_knows_its_fields() -> None:
    assert Sample().replace(count=5) == Sample(count=5)
    with pytest.raises(UserError, match="unknown option cuont for Sample"):
        Sample().replace(cuont=5)


def parsed(options: type[Options], *arguments: str) -> Options:
    parser = argparse.ArgumentParser(exit_on_error=False)
    add_flags(parser, options)
    return from_flags(options, parser.parse_args(arguments))


def test_flags_say_the_same() -> None:
    line = "--count 8 --size 96 --gain 2.5 --low -3 --quick --kind b --edge 16 --limit 0".split()
    assert parsed(Sample, *line) == Sample(8, 96, 2.5, -3.0, 0.0, True, "b", 16, 0.0)
    assert parsed(Sample) == Sample()
    assert parsed(Sample, "--no-quick") == Sample()


@pytest.mark.parametrize(
    ("flag", "text"), [("--count", "9"), ("--count", "1.0"), ("--gain", "nan"), ("--kind", "c"), ("--edge", "9")]
)
def test_a_bad_flag_says_what_is_allowed(flag: str, text: str) -> None:
    spec = next(s for s in specs(Sample) if s.flag == flag)
    with pytest.raises(argparse.ArgumentError) as error:
        parsed(Sample, flag, text)
    assert f"{text}: must be {spec.allowed}" in str(error.value)


def test_help_gives_unit_and_default() -> None:
    parser = argparse.ArgumentParser()
    add_flags(parser, Sample)
    text = " ".join(parser.format_help().split())
    assert "how many, 100 % of them (default 3)" in text
    assert "edge [px] (default 64)" in text
    assert "unset: none" in text and "None" not in text


def test_a_command_may_have_other_defaults() -> None:
    parser = argparse.ArgumentParser()
    add_flags(parser, Sample, defaults={"size": 96})
    assert "edge [px] (default 96)" in " ".join(parser.format_help().split())
    assert from_flags(Sample, parser.parse_args([]), {"size": 96, "of others": 1}).size == 96
    assert from_flags(Sample, parser.parse_args(["--size", "32"]), {"size": 96}).size == 32


@pytest.mark.parametrize(("options", "spec"), FIELDS, ids=[f"{o.__name__}.{s.name}" for o, s in FIELDS])
def test_every_option_of_the_program_is_well_declared(options: type[Options], spec: Spec) -> None:
    assert spec.help and not spec.help.endswith(".")
    assert spec.default == getattr(options(), spec.name)
    if spec.type is str:
        assert spec.choices
    if spec.type in (int, float) and not spec.choices:
        assert spec.minimum is not None and spec.maximum is not None, "a widget needs a range"
        for edge in (spec.minimum, spec.maximum):
            spec.check(spec.type(edge))
        for beyond in (spec.minimum - 1, spec.maximum + 1):
            with pytest.raises(UserError):
                spec.check(spec.type(beyond))
    if spec.logarithmic:
        assert spec.minimum is not None and spec.minimum >= 0  # where it is 0, that lies below the least on the slider


def test_no_two_options_share_a_flag() -> None:
    flags = [spec.flag for _, spec in FIELDS]
    assert len(set(flags)) == len(flags) == sum(len(fields(options)) for options in ALL)
