"""The stack with two robots, in a home of its own."""

from __future__ import annotations

from tests.frog.conftest import start_frog

__all__ = ["start_frog"]
