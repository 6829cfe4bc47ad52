"""Walks of the camera, written by hand as TOML. Unknown keys are errors; an error names file, key and reason.

    seconds = 20                # how long the walk takes
    frames_per_second = 30      # of its pictures
    [[key]]                     # where the eye is: position, target [m]; yfov_deg, else that of the key before, at first 45;
                                # time [s]: of all keys or of none, which are then evenly spaced

Positions, targets and angles run through the keys on a smooth curve, each of their numbers without going beyond those of the two
keys about it [Fritsch84]: an eye between two walls stays there. The first picture shows the first key and the last one the last;
before the time of the first key and after that of the last the eye stands still. The horizon is level.
"""

from __future__ import annotations

import itertools
import math
import tomllib
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Self

import numpy as np
from pydantic import Field, ValidationError, model_validator
from scipy.interpolate import PchipInterpolator

from app.errors import UserError
from app.render.camera import UP, CameraView
from app.scene.authored_tables import Table
from app.scene.gltf_file import first_problem
from app.scene.library import path_file, path_names
from app.scene.model import F64
from app.util.words import one_line

MOST_FRAMES = 10_000
FAR = 1e6  # m from the origin: more is a slip
SHORTEST = 1e-3  # s: of a walk, and between two keys
MEETING = 1e-6  # m between the eye and its target: nearer, no direction is known
VERTICAL = 1e-4  # horizontal part of a unit direction: with less, no heading is known

Metres = Annotated[float, Field(ge=-FAR, le=FAR)]
Point = tuple[Metres, Metres, Metres]


class KeyTable(Table):
    position: Point
    target: Point
    yfov_deg: Annotated[float, Field(gt=0.0, lt=180.0)] | None = None
    time: Annotated[float, Field(ge=0.0)] | None = None

    @model_validator(mode="after")
    def _apart(self) -> Self:
        if math.dist(self.position, self.target) < MEETING:
            raise ValueError("position and target must differ")
        return self


class PathFile(Table):
    """A whole TOML path."""

    seconds: Annotated[float, Field(ge=SHORTEST)]
    frames_per_second: Annotated[float, Field(gt=0.0)] = 30.0
    key: Annotated[list[KeyTable], Field(min_length=1)]

    @model_validator(mode="after")
    def _in_time(self) -> Self:
        given = [(i, key.time) for i, key in enumerate(self.key) if key.time is not None]
        if given and len(given) < len(self.key):
            raise ValueError("give the time of all keys or of none")
        for (_, before), (i, time) in itertools.pairwise(given):
            if time - before < SHORTEST:
                raise ValueError(f"key.{i}.time: {time:g} s must come after {before:g} s, that of the key before")
        if given and given[-1][1] > self.seconds:
            raise ValueError(f"key.{given[-1][0]}.time: {given[-1][1]:g} s is after the end, {self.seconds:g} s")
        return self

    @model_validator(mode="after")
    def _few_enough(self) -> Self:
        if not self.seconds * self.frames_per_second < MOST_FRAMES + 0.5:
            rate = f"{self.seconds:g} s at {self.frames_per_second:g} frames a second"
            raise ValueError(f"{rate}: at most {MOST_FRAMES:,} frames are allowed")
        return self

    @property
    def frames(self) -> int:
        return max(1, round(self.seconds * self.frames_per_second))

    @property
    def times(self) -> F64:
        """(keys,) [s]"""
        if self.key[0].time is None:
            return np.linspace(0.0, self.seconds, len(self.key))
        return np.array([key.time for key in self.key], np.float64)

    @property
    def yfovs(self) -> list[float]:
        """(keys,) [rad]"""
        filled = itertools.accumulate(
            (key.yfov_deg for key in self.key), lambda a, b: a if b is None else b, initial=45.0
        )
        return [math.radians(angle) for angle in itertools.islice(filled, 1, None) if angle is not None]


@dataclass(frozen=True, eq=False)
class CameraPath:
    """Where the eye is in each picture of a walk."""

    cameras: Sequence[CameraView]
    frames_per_second: float

    @property
    def first_only(self) -> CameraPath:
        """The same, of one picture."""
        return CameraPath(self.cameras[:1], self.frames_per_second)


def load_path(source: str, *, frames_per_second: float | None = None) -> CameraPath:
    """A path by its file, or by its name if it comes along. frames_per_second: instead of those in the file. Raises UserError,
    which names the file, the key and the reason."""
    shown = one_line(source)[:200]
    try:
        values = tomllib.loads(path_file(source).read_text("utf-8"))
        if frames_per_second is not None:
            values["frames_per_second"] = frames_per_second
        table = PathFile.model_validate(values)
        return CameraPath(_cameras(table), table.frames_per_second)
    except OSError as error:
        raise UserError(f"--path {shown}: cannot be read: {error.strerror}; {_allowed()}") from error
    except ValidationError as error:  # before ValueError, which it is
        raise UserError(f"--path {shown}: {one_line(first_problem(error))}") from error
    except _MeetingError as error:
        raise UserError(f"--path {shown}: {error}") from error
    except (ValueError, RuntimeError) as error:  # not TOML, not UTF-8, nested too deep, or no file name
        raise UserError(f"--path {shown}: not TOML: {one_line(str(error))}") from error


def _allowed() -> str:
    return f"allowed are .toml files and the paths {', '.join(path_names())}"


class _MeetingError(Exception):
    """The eye comes to where its target is."""


def _cameras(table: PathFile) -> list[CameraView]:
    """One for each picture. Raises _MeetingError."""
    times = np.linspace(0.0, table.seconds, table.frames)
    eyes = _through(table.times, [key.position for key in table.key], times)
    targets = _through(table.times, [key.target for key in table.key], times)
    yfovs = _through(table.times, [[angle] for angle in table.yfovs], times)[:, 0]
    distances = np.linalg.norm(targets - eyes, axis=1)
    near = int(np.argmin(distances))
    if distances[near] < MEETING:
        key = int(np.searchsorted(table.times, times[near]))
        raise _MeetingError(f"key.{key}: the eye meets its target on the way there, at {times[near]:.2f} s")
    matrices = _world_from_camera(eyes, targets)
    return [CameraView(*view) for view in zip(matrices, yfovs.tolist(), distances.tolist(), strict=True)]


def _through(key_times: F64, values: Sequence[Sequence[float]], times: F64) -> F64:
    """(n, k) at ``times`` (n,) of a smooth curve through ``values`` (keys, k); as at its ends before and after."""
    if len(values) == 1:
        return np.tile(np.array(values, np.float64), (len(times), 1))
    curve = PchipInterpolator(key_times, np.array(values, np.float64), axis=0)
    found: F64 = curve(np.clip(times, key_times[0], key_times[-1]))
    return found


def _world_from_camera(eyes: F64, targets: F64) -> F64:
    """(n, 4, 4) rigid, at ``eyes`` (n, 3), looking at ``targets`` (n, 3) with a level horizon. Straight up or down the heading is
    that of the nearest picture that has one, else -z."""
    back = _unit(eyes - targets)
    right = np.cross(UP, back)
    known = np.linalg.norm(right, axis=1) > VERTICAL
    headed = np.flatnonzero(known)
    for k in np.flatnonzero(~known):
        right[k] = right[headed[np.argmin(np.abs(headed - k))]] if len(headed) else (1.0, 0.0, 0.0)
    up = _unit(np.cross(back, right))
    matrices = np.tile(np.eye(4), (len(eyes), 1, 1))
    matrices[:, :3] = np.stack([np.cross(up, back), up, back, eyes], axis=2)
    return matrices


def _unit(vectors: F64) -> F64:
    unit: F64 = vectors / np.linalg.norm(vectors, axis=1, keepdims=True)
    return unit
