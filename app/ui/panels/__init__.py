"""Panels: plain functions over a session and the interface's state. Each draws the inside of one docked window."""
