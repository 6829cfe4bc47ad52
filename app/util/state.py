"""A state is all that is to be kept of something that is to go on later: plain values and arrays, by name."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import DTypeLike, NDArray

from app.errors import UserError

SEPARATOR = "/"  # between the name of a part and a name in it


class StateError(UserError):
    """A state that does not fit what it is given to."""


@dataclass(eq=False)
class State:
    """values: numbers, texts, and lists and dicts of them, as JSON has them. Names of parts come before those in them."""

    values: dict[str, Any] = field(default_factory=dict)
    arrays: dict[str, NDArray[Any]] = field(default_factory=dict)

    def put(self, name: str, part: State) -> None:
        """Have another state as a part."""
        self.values.update({f"{name}{SEPARATOR}{key}": value for key, value in part.values.items()})
        self.arrays.update({f"{name}{SEPARATOR}{key}": array for key, array in part.arrays.items()})

    def part(self, name: str) -> State:
        """What was put under this name; empty where nothing was."""
        start = name + SEPARATOR
        return State(
            {key.removeprefix(start): value for key, value in self.values.items() if key.startswith(start)},
            {key.removeprefix(start): array for key, array in self.arrays.items() if key.startswith(start)},
        )

    def array(self, name: str, dtype: DTypeLike, *shape: int) -> NDArray[Any]:
        """The array of this name. shape: what it must be, -1 for any length. Raises StateError."""
        array = self.arrays.get(name)
        if array is None:
            raise StateError(f"{name} is missing")
        fits = array.dtype == np.dtype(dtype) and array.ndim == len(shape)
        if not fits or any(want not in (-1, have) for want, have in zip(shape, array.shape, strict=True)):
            raise StateError(f"{name} is {array.dtype} {array.shape} where {np.dtype(dtype)} {shape} is needed")
        return array


@contextmanager
def fitting() -> Iterator[None]:
    """Raise StateError for whatever a state that was made up, or cut short, runs into while it is taken over."""
    try:
        yield
    except StateError:
        raise
    except (LookupError, ValueError, TypeError, ArithmeticError, AttributeError) as error:
        raise StateError(f"it does not hold together ({type(error).__name__}: {error})") from error


__all__ = ["State", "StateError", "fitting"]
