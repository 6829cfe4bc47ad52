"""Settings: all knobs of window and terminal as tables of one TOML file, and the presets that come along.

    solver = "gathering"

    [gathering]
    noise = 0.01       # converged when the noise that is left ...

A table is a set of options (``TABLES``), a key one of them; what a file does not name stays as it is.
"""

from __future__ import annotations

import difflib
import json
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from app.atlas.options import AtlasOptions
from app.errors import UserError
from app.lightmap.options import LightmapOptions
from app.options import Options, Spec, option, specs
from app.render.options import DisplayOptions
from app.solvers import SOLVERS
from app.util.files import replacing

ALIKE = 0.6  # share of letters in common that makes a key a likely slip for another
MOST_BYTES = 1 << 20  # of a file
OF_ONE_SCENE = (
    "layer",
    "show",
    "split",
    "exposure",
    "false_colour_max",
)  # and what one looks at in it: written as comments
FILE_WIDTH = 44  # columns, where comments begin


@dataclass(frozen=True)
class StopOptions(Options):
    """When a solve of the terminal ends, besides when it has converged."""

    time: float | None = option(None, "after so long a solve", unit="s", minimum=1e-3, maximum=1e9)
    error: float | None = option(
        None, "once the expected error, the median of local errors, is so small", unit="%", minimum=1e-6, maximum=1e6
    )
    error_rms: float | None = option(
        None, "once the expected error, the relative RMS, is so small", unit="%", minimum=1e-6, maximum=1e6
    )


TABLES: Mapping[str, type[Options]] = {
    "texels": AtlasOptions,
    "lightmap": LightmapOptions,
    **{name: family.options for name, family in SOLVERS.items()},
    "stop": StopOptions,
    "display": DisplayOptions,
}

# Good is what a bake is without settings; Draft is for a look, Final for what is shipped. `glowtree bench presets` measures them.
PRESETS: Mapping[str, Mapping[str, Any]] = {
    "draft": {"solver": "gathering", "gathering": {"noise": 0.05}},
    "good": {"solver": "gathering", "gathering": {"noise": 0.01}},
    "final": {"solver": "gathering", "gathering": {"noise": 0.003}},
}


@dataclass(frozen=True)
class Settings:
    """Some or all of the knobs. solver: by name; tables: of TABLES, what is given of each."""

    solver: str | None = None
    tables: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)

    def of(self, table: str, options: Options) -> Any:
        """Those options with what is given of them."""
        return options.replace(**self.tables.get(table, {}))


def settings_of(source: str | Path, more: Mapping[str, type[Options]] | None = None) -> Settings:
    """Of a preset by its name, or of a file. more: tables that a host adds to TABLES. Raises UserError, one line that names
    the file, the key, what is allowed and what may have been meant."""
    known = dict(TABLES) | dict(more or {})
    if str(source) in PRESETS:
        return checked(PRESETS[str(source)], str(source), known)
    path = Path(source).expanduser()
    try:
        with path.open("rb") as file:
            text = file.read(MOST_BYTES + 1)
    except FileNotFoundError:
        raise UserError(f"{source}: no such settings: neither a file nor one of {', '.join(PRESETS)}") from None
    except OSError as error:
        raise UserError(f"{source}: cannot be read: {error.strerror or error}") from None
    if len(text) > MOST_BYTES:
        raise UserError(f"{source}: are no settings: more than {MOST_BYTES >> 20} MiB")
    try:
        values = tomllib.loads(text.decode())
    except (tomllib.TOMLDecodeError, UnicodeDecodeError, RecursionError) as error:
        raise UserError(f"{source}: is no TOML: {' '.join(str(error).split())}") from None
    return checked(values, str(source), known)


def checked(values: Mapping[str, Any], source: str, known: Mapping[str, type[Options]] = TABLES) -> Settings:
    """Plain values as settings. Raises UserError."""
    solver, tables = None, {}
    for name, value in values.items():
        if name == "solver":
            if not isinstance(value, str) or value not in SOLVERS:
                raise UserError(f"{source}: solver = {_shown(value)}: must be one of {', '.join(SOLVERS)}")
            solver = value
        elif name not in known:
            raise UserError(f"{source}: unknown {_kind(value)} {_word(name)}{nearest(name, ['solver', *known])}")
        elif not isinstance(value, Mapping):
            raise UserError(f"{source}: {name} must be a table [{name}]")
        else:
            tables[name] = _table(value, f"{source}: {name}", known[name])
    return Settings(solver, tables)


def _table(values: Mapping[str, Any], place: str, options: type[Options]) -> dict[str, Any]:
    known = {spec.name: spec for spec in specs(options)}
    given = {}
    for name, value in values.items():
        spec = known.get(name)
        if spec is None:
            raise UserError(f"{place}: unknown key {_word(name)}{nearest(name, list(known))}")
        if isinstance(value, int) and not isinstance(value, bool) and spec.type is float:
            value = float(value)
        try:
            spec.check(value)
        except UserError:
            raise UserError(f"{place}.{name} = {_shown(value)}: must be {spec.allowed}") from None
        given[name] = value
    return given


def nearest(name: str, known: list[str]) -> str:
    """What may have been meant, to end a message with."""
    close = difflib.get_close_matches(name, known, n=1, cutoff=ALIKE)
    return f"; did you mean {close[0]}?" if close else f"; there are {', '.join(known)}"


def _kind(value: Any) -> str:
    return "table" if isinstance(value, Mapping) else "key"


def _word(text: str) -> str:
    return text if text.isprintable() and 0 < len(text) <= 80 else json.dumps(text[:80])


def _shown(value: Any) -> str:
    text = json.dumps(value, default=str)
    return text if len(text) <= 80 else text[:77] + "..."


# -- written -----------------------------------------------------------------------------------------------------------


def settings_text(solver: str, tables: Mapping[str, Options]) -> str:
    """The file of all that these options are; each with its meaning, unit and range. What is unset stands as a comment."""
    lines = [
        "# Settings of glowtree: `--settings FILE` in the terminal, File > Settings in the window.",
        f"# What is not given stays as it is. solver: {', '.join(SOLVERS)}",
        "",
        f"solver = {json.dumps(solver)}",
    ]
    for name, options in tables.items():
        lines += ["", f"[{name}]"]
        lines += [_line(spec, getattr(options, spec.name)) for spec in specs(type(options))]
    return "\n".join(lines) + "\n"


def _line(spec: Spec, value: Any) -> str:
    unit = f" [{spec.unit}]" if spec.unit else ""
    given = f"# {spec.name} =" if value is None else f"{spec.name} = {_toml(value)}"
    given = f"# {given}" if spec.name in OF_ONE_SCENE else given
    return f"{given:<{FILE_WIDTH}}  # {spec.help}{unit}: {spec.allowed}"


def _toml(value: Any) -> str:
    return json.dumps(value)  # of numbers, truth and printable text TOML is the same


def write_settings(path: Path, text: str) -> None:
    """Put the file there, whole. Raises UserError."""
    try:
        with replacing(path) as partial:
            partial.write_text(text)
    except OSError as error:
        raise UserError(f"{path}: cannot be written: {error.strerror or error}") from None


__all__ = [
    "PRESETS",
    "TABLES",
    "Settings",
    "StopOptions",
    "checked",
    "nearest",
    "settings_of",
    "settings_text",
    "write_settings",
]
