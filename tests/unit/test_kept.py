"""Choices that outlive a run."""

from __future__ import annotations

import argparse
from pathlib import Path

import pytest

from app.commands.view import _display
from app.util.kept import FILE, keep, kept


def test_choices_are_kept_beside_others(tmp_path: Path) -> None:
    assert kept(tmp_path) == {}
    keep(tmp_path, quantities="radiometric", other=[1, 2])
    keep(tmp_path, quantities="photometric")
    assert kept(tmp_path) == {"quantities": "photometric", "other": [1, 2]}
    assert [file.name for file in tmp_path.iterdir()] == [FILE]


@pytest.mark.parametrize("content", ["", "{", "[1]", "\0"])
def test_a_broken_file_keeps_nothing(tmp_path: Path, content: str) -> None:
    (tmp_path / FILE).write_text(content)
    assert kept(tmp_path) == {}
    keep(tmp_path, quantities="radiometric")
    assert kept(tmp_path) == {"quantities": "radiometric"}


def test_a_folder_that_cannot_be_written_is_no_error(tmp_path: Path) -> None:
    keep(tmp_path / "nowhere", quantities="radiometric")
    assert kept(tmp_path / "nowhere") == {}


@pytest.mark.parametrize(
    ("flag", "last", "shown"),
    [
        (None, "radiometric", "radiometric"),
        ("photometric", "radiometric", "photometric"),
        (None, "feet", "photometric"),
        (None, None, "photometric"),
    ],
)
def test_light_is_counted_as_in_the_last_run(tmp_path: Path, flag: str | None, last: str | None, shown: str) -> None:
    keep(tmp_path, quantities=last)
    assert _display(argparse.Namespace(quantities=flag), tmp_path).quantities == shown
