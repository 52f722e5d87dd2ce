"""FROG, and several hosts, for evidence."""

from tests.frog.conftest import frog, start_frog
from tests.host.conftest import site

__all__ = ["frog", "site", "start_frog"]
