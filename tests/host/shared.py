"""A module that has much in memory before the components that use it are forked."""

from __future__ import annotations

from regraft import service
from tests.host.parts import Tick, Ticker

SHARED = b"x" * (200 * 2**20)


class Sharing(Ticker):
    """Ticks, and has what all of its class have."""

    @service("begun")
    def begun(self, _: Tick) -> Tick:
        """Say how often it has ticked."""
        return Tick(self.count)
