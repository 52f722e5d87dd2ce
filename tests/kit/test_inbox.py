"""The inbox: order kept, waits bounded, early ends harmless."""

from __future__ import annotations

import threading
import time
from collections.abc import Iterator

import pytest

from regraft.bus.inbox import Inbox
from regraft.bus.socket_inbox import SocketInbox

LONG = 10.0


@pytest.fixture(params=[Inbox, SocketInbox])
def inbox(request: pytest.FixtureRequest) -> Iterator[Inbox]:
    """An empty inbox of either kind."""
    made: Inbox = request.param()
    yield made
    made.close()


def test_items_come_in_the_order_of_their_arrival(inbox: Inbox) -> None:
    for number in range(100):
        inbox.put(number)
    assert [inbox.get(0.0) for _ in range(100)] == list(range(100))
    assert inbox.get(0.0) is None


def test_every_wait_ends_with_nothing_where_nothing_comes(inbox: Inbox) -> None:
    for seconds in (0.02, 0.001, 0.05, 0.005):
        assert inbox.get(seconds) is None
        assert inbox.get_until(time.monotonic() + seconds) is None
        assert inbox.get_until(time.monotonic() - seconds) is None


def test_a_wait_that_is_over_before_it_has_begun_ends(inbox: Inbox) -> None:
    for number in range(200_000):
        inbox.put(number)
        assert inbox.get(0.0) == number
        assert inbox.get(1e-9) is None


def test_an_earlier_time_takes_the_place_of_a_later_one(inbox: Inbox) -> None:
    began = time.monotonic()
    threading.Timer(0.01, inbox.put, ("item",)).start()
    assert inbox.get(LONG) == "item"  # leaves the alarm set to a time far off
    assert inbox.get(0.01) is None
    assert time.monotonic() - began < LONG


def test_an_item_ends_a_wait_whatever_the_alarm_does(inbox: Inbox) -> None:
    taken: list[int] = []
    sender = threading.Thread(target=lambda: [inbox.put(number) for number in range(1000)])
    sender.start()
    while len(taken) < 1000:
        item = inbox.get(0.004)
        if item is not None:
            taken.append(item)
    sender.join()
    assert taken == list(range(1000))


def test_lazy_items_are_taken_behind_others(inbox: Inbox) -> None:
    for number in range(3):
        inbox.put_lazy(number)
    inbox.put("put")
    assert inbox.qsize() == 4
    assert [inbox.get(LONG) for _ in range(4)] == ["put", 0, 1, 2]
    assert inbox.empty()


def test_an_eager_reader_is_woken_by_lazy_items(inbox: Inbox) -> None:
    inbox.eager = True
    taken: list[int] = []

    def send() -> None:
        for number in range(1000):
            inbox.put_lazy(number)

    sender = threading.Thread(target=send)
    sender.start()
    while len(taken) < 1000:
        item = inbox.get(LONG)
        if item is not None:
            taken.append(item)
    sender.join()
    assert taken == list(range(1000))


def test_becoming_attentive_misses_nothing(inbox: Inbox) -> None:
    for _ in range(300):
        sender = threading.Thread(target=inbox.put_lazy, args=("item",))
        sender.start()
        inbox.eager = True
        taken = list(inbox.take_lazy())
        began = time.monotonic()
        while not taken:
            item = inbox.get(LONG)
            if item is not None:
                taken.append(item)
        assert time.monotonic() - began < LONG
        sender.join()
        inbox.eager = False
        while inbox.get(0.0) is not None:
            pass
