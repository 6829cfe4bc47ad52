"""Milliseconds: of a shot and its passes, beside the memory they move, and of the viewer's frames."""
