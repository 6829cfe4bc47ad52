"""Error against time."""
