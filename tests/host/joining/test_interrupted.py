"""A host that is interrupted while it joins has left in order: the first host may have taken it in already."""

from __future__ import annotations

import signal
from collections.abc import Iterator
from typing import Any

import pytest

from regraft.bus.interface import Answer, BusError
from regraft.bus.memory_bus import MemoryBus, MemoryHub
from regraft.bus_schema.encoding import codec
from regraft.bus_schema.keys import Keys
from regraft.bus_schema.messages.protocol.joining import JoinHost, Lease, RenewLease
from regraft.bus_schema.model.hosts.hosts import LOCAL
from regraft.host.joining.leaving import ATTEMPTS
from regraft.process.shutdown import ASKING, ShutdownRequest
from regraft.security.host_proof import Seal
from regraft.system.first_host import FirstHost

KEYS = Keys("tests")
WANTED = JoinHost("edge", "its instance")


@pytest.fixture
def ending() -> Iterator[ShutdownRequest]:
    """Return a request that hears signals, until the test is over."""
    before = {number: signal.getsignal(number) for number in ASKING}
    request = ShutdownRequest()
    request.hear_signals()
    yield request
    for number, handler in before.items():
        signal.signal(number, handler)


class FirstHostStub:
    """Interrupts who asks it to join, and answers only the last of so many goodbyes."""

    def __init__(self, hub: MemoryHub, answers_goodbye: int) -> None:
        self.goodbyes: list[RenewLease] = []
        self._answers_goodbye = answers_goodbye
        bus = MemoryBus(hub)
        bus.serve(KEYS.host(LOCAL, "join"), lambda _: signal.raise_signal(signal.SIGINT))
        bus.serve(KEYS.host(LOCAL, "renew"), self._take_goodbye)

    def _take_goodbye(self, query: Any) -> None:
        self.goodbyes.append(codec.decode(query.payload, RenewLease))
        if len(self.goodbyes) == self._answers_goodbye:
            query.reply(codec.encode(Lease(held=True)))


@pytest.mark.parametrize("answered", [1, 2])
def test_who_is_interrupted_while_it_joins_announces_until_it_is_answered_that_it_leaves(
    ending: ShutdownRequest, answered: int
) -> None:
    hub = MemoryHub()
    stub = FirstHostStub(hub, answered)
    with pytest.raises(KeyboardInterrupt):
        FirstHost(MemoryBus(hub), KEYS, ending).join(WANTED, Seal(b"secret"))
    assert len(stub.goodbyes) == answered
    assert {(goodbye.host, goodbye.instance, goodbye.leaving) for goodbye in stub.goodbyes} == {
        (WANTED.host, WANTED.instance, True)
    }
    assert len({goodbye.seal for goodbye in stub.goodbyes}) == answered, "each attempt has a seal of its own"


def test_a_first_host_that_answers_no_goodbye_keeps_nobody(ending: ShutdownRequest) -> None:
    hub = MemoryHub()
    stub = FirstHostStub(hub, answers_goodbye=0)
    with pytest.raises(KeyboardInterrupt):
        FirstHost(MemoryBus(hub), KEYS, ending).join(WANTED, Seal())
    assert len(stub.goodbyes) == ATTEMPTS


class CutBus(MemoryBus):
    """A bus that nothing gets through once somebody has interrupted."""

    def __init__(self, hub: MemoryHub, ending: ShutdownRequest) -> None:
        super().__init__(hub)
        self._ending = ending

    def query(self, key: str, payload: bytes, timeout: float, *, all_of_them: bool = False) -> list[Answer]:
        """Ask, or raise BusError."""
        if self._ending.wanted:
            raise BusError("the link is cut")
        return super().query(key, payload, timeout, all_of_them=all_of_them)


def test_an_interrupt_stays_one_where_the_link_is_gone(ending: ShutdownRequest) -> None:
    hub = MemoryHub()
    stub = FirstHostStub(hub, answers_goodbye=0)
    with pytest.raises(KeyboardInterrupt):
        FirstHost(CutBus(hub, ending), KEYS, ending).join(WANTED, Seal())
    assert not stub.goodbyes
