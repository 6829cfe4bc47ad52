"""What a user chose once and finds again in the next run: plain values by name, in a file of the user's own folder."""

from __future__ import annotations

import contextlib
import json
from pathlib import Path
from typing import Any

from app.util.files import replacing

FILE = "choices.json"


def kept(folder: Path) -> dict[str, Any]:
    """All values that are kept in a folder; none where there is no such file, or it is broken."""
    try:
        values = json.loads((folder / FILE).read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return {}
    return values if isinstance(values, dict) else {}


def keep(folder: Path, **values: Any) -> None:
    """Keep these besides the others. A folder that cannot be written keeps nothing."""
    now = kept(folder)
    if now | values == now:
        return
    with contextlib.suppress(OSError), replacing(folder / FILE) as partial:
        partial.write_text(json.dumps(now | values, indent=2, sort_keys=True), encoding="utf-8")
