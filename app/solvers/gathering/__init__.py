"""Gathering along rays that are traced once: a piece of work is ``Gathering._gather_more`` in solver.py."""
