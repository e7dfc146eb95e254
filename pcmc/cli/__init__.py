"""The ``pcmc`` command."""

from .running import main

__all__ = ["main"]
