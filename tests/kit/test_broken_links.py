"""A session whose link to the hub breaks goes on, as another, with everything that was declared."""

from __future__ import annotations

import threading
from collections.abc import Iterator

import pytest

from regraft.bus.interface import BusError, Presence, Publisher
from regraft.bus.zenoh_bus import ZenohBus, open_bus
from regraft.bus.zenoh_config import Endpoints
from tests.support.links import Cable
from tests.support.machine.ports import free_port
from tests.support.waiting import wait_until


@pytest.fixture
def hub() -> Iterator[tuple[ZenohBus, int]]:
    port = free_port()
    bus = open_bus(Endpoints(listen=(f"tcp/127.0.0.1:{port}",), router=True))
    yield bus, port
    bus.close()


@pytest.fixture
def other(hub: tuple[ZenohBus, int]) -> ZenohBus:
    return hub[0]


@pytest.fixture
def cable(hub: tuple[ZenohBus, int]) -> Iterator[Cable]:
    cable = Cable(hub[1])
    yield cable
    cable.close()


@pytest.fixture
def bus(cable: Cable) -> Iterator[ZenohBus]:
    bus = open_bus(Endpoints(connect=(f"tcp/127.0.0.1:{cable.port}",)))
    yield bus
    bus.close()


class Life:
    """One of everything that a session can declare, and its counterparts on the other side."""

    def __init__(self, bus: ZenohBus, other: ZenohBus) -> None:
        self.bus, self.other = bus, other
        self.heard: list[bytes] = []
        self.heard_there: list[bytes] = []
        self.present: set[str] = set()
        self.present_there: set[str] = set()
        bus.subscribe("s/down", lambda item: self.heard.append(item.payload.to_bytes()))
        bus.serve("s/ask", self._answer)
        bus.announce("s/near/alive")
        bus.watch("s/far/alive", lambda presence: _note(self.present, presence))
        self.up = bus.publisher("s/up", "", reliable=True)
        other.subscribe("s/up", lambda item: self.heard_there.append(item.payload.to_bytes()))
        other.announce("s/far/alive")
        other.watch("s/near/alive", lambda presence: _note(self.present_there, presence))
        self.down = other.publisher("s/down", "", reliable=True)

    def _answer(self, item: object) -> None:
        query = self.bus.open_query(item)
        assert query is not None
        query.reply(b"here")

    def goes_on(self) -> None:
        """Wait until each of them works, with what is put from now on."""
        heard, heard_there = len(self.heard), len(self.heard_there)
        wait_until(lambda: _put(self.up) and len(self.heard_there) > heard_there, "to be heard")
        wait_until(lambda: _put(self.down) and len(self.heard) > heard, "to hear")
        wait_until(lambda: [a.payload for a in self.other.query("s/ask", b"", 1.0)] == [b"here"], "to answer")
        wait_until(lambda: self.present == {"s/far/alive"} and self.present_there == {"s/near/alive"}, "the tokens")


def _put(publisher: Publisher) -> bool:
    publisher.put(b"something", b"")
    return True


def _note(present: set[str], presence: Presence) -> None:
    (present.add if presence.present else present.discard)(presence.key)


def test_all_that_was_declared_works_again_after_each_of_many_cuts(
    bus: ZenohBus, other: ZenohBus, cable: Cable
) -> None:
    life = Life(bus, other)
    for _ in range(20):
        life.goes_on()
        cable.cut()
    life.goes_on()


def test_without_a_link_puts_are_lost_and_questions_unanswered_and_nothing_is_raised(
    bus: ZenohBus, other: ZenohBus, cable: Cable
) -> None:
    life = Life(bus, other)
    life.goes_on()
    cable.plugged = False
    cable.cut()
    wait_until(lambda: not life.up.matched and not life.present_there, "the cut")
    life.up.put(b"lost", b"")
    assert bus.query("s/nobody", b"", 0.1) == []
    assert bus.present("s/far/alive", 0.1) == []
    told: list[object] = []
    bus.ask("s/nobody", b"", 0.1, told.append)
    wait_until(lambda: told == [[]], "that nobody answers")
    cable.plugged = True
    life.goes_on()
    assert b"lost" not in life.heard_there


def test_what_is_declared_and_closed_without_a_link_is_so_when_it_is_back(
    bus: ZenohBus, other: ZenohBus, cable: Cable
) -> None:
    life = Life(bus, other)
    gone: list[object] = []
    closed = bus.subscribe("s/down", gone.append)
    life.goes_on()
    cable.plugged = False
    cable.cut()
    wait_until(lambda: not life.present_there, "the cut")
    closed.close()
    closed.close()
    gone.clear()
    late: list[object] = []
    bus.subscribe("s/down", late.append)
    bus.announce("s/near/late/alive")
    cable.plugged = True
    life.goes_on()
    wait_until(lambda: late != [], "what was declared in between")
    wait_until(lambda: other.present("s/near/late/alive", 1.0) == ["s/near/late/alive"], "its token")
    assert gone == []


def test_what_is_gone_when_the_link_is_back_is_told_as_gone(bus: ZenohBus, other: ZenohBus, cable: Cable) -> None:
    token = other.announce("s/far/brief")
    present: set[str] = set()
    bus.watch("s/far/*", lambda presence: _note(present, presence))
    wait_until(lambda: present == {"s/far/brief"}, "the token")
    cable.plugged = False
    cable.cut()
    token.close()
    cable.plugged = True
    wait_until(lambda: present == set(), "its end")


def test_a_closed_session_comes_not_back(bus: ZenohBus, other: ZenohBus, cable: Cable) -> None:
    of_others = set(threading.enumerate())
    life = Life(bus, other)
    life.goes_on()
    cable.plugged = False
    cable.cut()
    bus.close()
    bus.close()
    assert "zenoh-renewal" not in [thread.name for thread in threading.enumerate() if thread not in of_others]
    cable.plugged = True
    wait_until(lambda: not life.present_there, "the end")
    assert other.present("s/near/alive", 1.0) == []
    assert other.query("s/ask", b"", 0.1) == []


def test_a_session_that_was_closed_says_so(bus: ZenohBus) -> None:
    publisher = bus.publisher("s/up", "", reliable=True)
    bus.close()
    with pytest.raises(BusError, match="s/up"):
        publisher.put(b"", b"")
    with pytest.raises(BusError, match="s/ask"):
        bus.query("s/ask", b"", 0.1)
