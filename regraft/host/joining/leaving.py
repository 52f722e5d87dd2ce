"""Announces to the first host that a host leaves: else it would count as lost."""

from __future__ import annotations

from collections.abc import Callable

from regraft.bus.interface import Bus
from regraft.bus_schema.encoding import codec
from regraft.bus_schema.keys import Keys
from regraft.bus_schema.messages.protocol.joining import RenewLease
from regraft.bus_schema.model.hosts.hosts import LOCAL

ANSWER_TIMEOUT = 0.6
"""Seconds for which an answer is waited for before the next attempt."""
ATTEMPTS = 5


def announce(bus: Bus, keys: Keys, sign: Callable[[], RenewLease], attempts: int = ATTEMPTS) -> None:
    """Send a host's last sign of life until it is answered; each attempt has a seal of its own. Raises BusError."""
    for _ in range(attempts):
        if bus.query(keys.host(LOCAL, "renew"), codec.encode(sign()), ANSWER_TIMEOUT):
            return
