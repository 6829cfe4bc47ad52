"""A bake read back: the irradiance, and the scene whose second texture coordinates say where it lies."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import OpenEXR

from app.bake import IRRADIANCE_NAME, REPORT_NAME, SCENE_NAME
from app.bake.light_files import page_names
from app.errors import UserError
from app.scene.load import load_scene
from app.scene.model import F32, Scene
from app.scene.options import FileOptions


@dataclass(frozen=True, eq=False)
class Bake:
    """scene: with uv1 in [0, 1], v = 0 in the first row; irradiance (H, W, 3) f32 [W/m²]; report: what report.json says, empty
    where there is none."""

    folder: Path
    scene: Scene
    irradiance: F32
    report: dict[str, Any]


def read_bake(path: Path) -> Bake:
    """Of a folder, or of one that a file of the bake is in. Raises UserError."""
    folder = path if path.is_dir() else path.parent
    if (folder / page_names(2)[0]).is_file():
        raise UserError(f"{path}: is a bake of several pages, a reference is one: bake it without --max-size")
    missing = [name for name in (IRRADIANCE_NAME, SCENE_NAME) if not (folder / name).is_file()]
    if missing:
        raise UserError(f"{path}: is no bake, {' and '.join(missing)} missing: 'glowtree bake' writes one")
    scene = load_scene(folder / SCENE_NAME, FileOptions(unit="m", up="y"))
    if scene.uv1 is None:
        raise UserError(f"{folder / SCENE_NAME}: no second texture coordinates, which say where its light lies")
    return Bake(folder, scene, read_irradiance(folder / IRRADIANCE_NAME), _report(folder / REPORT_NAME))


def read_irradiance(path: Path) -> F32:
    """(height, width, 3) f32 [W/m²], the first scanline first. Raises UserError."""
    try:
        channels = OpenEXR.File(str(path)).channels()
    except (RuntimeError, ValueError, TypeError) as error:  # what the library raises for any failure to read
        raise UserError(f"{path}: cannot be read as OpenEXR ({str(error).strip() or type(error).__name__})") from None
    colours = next((channels[name].pixels for name in ("RGB", "RGBA") if name in channels), None)
    if colours is None:
        raise UserError(f"{path}: has channels {', '.join(channels) or 'none'}: R, G, B are needed")
    irradiance = np.ascontiguousarray(colours[..., :3], np.float32)
    if not np.isfinite(irradiance).all():
        raise UserError(f"{path}: some of its light is not finite")
    return irradiance


def _report(path: Path) -> dict[str, Any]:
    try:
        report = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError):  # a bake of another program has none
        return {}
    return report if isinstance(report, dict) else {}
