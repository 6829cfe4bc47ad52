"""Measurements on this machine: speed, accuracy, the papers' tables, other programs; here lies what they share."""
