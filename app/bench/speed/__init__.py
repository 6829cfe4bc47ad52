"""Milliseconds: of shots, passes and frames."""
