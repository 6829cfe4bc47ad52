"""Visibility is who sees whom: projections of the scene onto a patch's hemisphere, and rays."""
