"""The scenes that come along: the TOML files of the folder ``scenes``, by name."""

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
