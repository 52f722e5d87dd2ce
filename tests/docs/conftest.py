"""FROG, for the README's commands."""

from tests.frog.conftest import frog, start_frog

__all__ = ["frog", "start_frog"]
