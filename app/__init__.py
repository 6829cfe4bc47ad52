"""Glowtree: interactive progressive radiosity on the GPU."""

__version__ = "0.1.0"
