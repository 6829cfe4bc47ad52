"""Hard cases: scenes whose light is known, and the checks that it must pass."""
