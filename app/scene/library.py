"""The scenes that come along, and the walks through them: the TOML files of ``scenes`` and of ``scenes/paths``, by name."""

from __future__ import annotations

from pathlib import Path

import app
from app.errors import UserError


def scenes_folder() -> Path:
    """``scenes`` beside the package in a checkout, inside of it when installed."""
    package = Path(app.__file__).parent
    beside = package.parent / "scenes"
    return beside if (beside / "cornell-box.toml").is_file() else package / "scenes"


def scene_names() -> list[str]:
    """Names of all scenes that come along, sorted."""
    return sorted(path.stem for path in scenes_folder().glob("*.toml"))


def scene_path(name: str) -> Path:
    """The file of a scene by its name; UserError if there is none."""
    path = scenes_folder() / f"{name}.toml"
    if name not in scene_names():
        raise UserError(f"scene {name}: must be one of {', '.join(scene_names())}")
    return path


def path_names() -> list[str]:
    """Names of all walks that come along, sorted."""
    return sorted(path.stem for path in (scenes_folder() / "paths").glob("*.toml"))


def path_file(source: str) -> Path:
    """The file that ``source`` means, whether or not there is one; a name of a walk that comes along wins unless a file of that
    name exists."""
    own = Path(source).expanduser()
    return scenes_folder() / "paths" / f"{source}.toml" if source in path_names() and not own.is_file() else own
