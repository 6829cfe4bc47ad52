"""What a user can get wrong, as exceptions. Our own mistakes are assertions, never these."""

from __future__ import annotations

from pathlib import Path


class UserError(Exception):
    """Bad input: one line that says what, which value, and what is allowed. The command line exits with 2."""


class SceneError(UserError):
    """A scene that cannot be used. Names the file and the reason."""

    def __init__(self, source: str | Path, reason: str) -> None:
        super().__init__(f"{source}: {reason}")
        self.source = str(source)
        self.reason = reason


class GpuError(UserError):
    """No usable OpenGL: the context cannot be made, or a limit of it is too small for what was asked."""
