"""An inbox that waits for sockets too: nothing is missed, whichever comes first."""

from __future__ import annotations

import socket
import threading
import time
from collections.abc import Iterator
from functools import partial

import pytest

from regraft.bus.socket_inbox import SocketInbox

LONG = 10.0
EACH = 5000


@pytest.fixture
def inbox() -> Iterator[SocketInbox]:
    """An empty inbox."""
    made = SocketInbox()
    yield made
    made.close()


def _watched(inbox: SocketInbox) -> tuple[socket.socket, socket.socket]:
    """Return both ends of a connection; what comes at the second one is an item."""
    near, far = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    inbox.watch(far, lambda: far.recv(100) or None)
    return near, far


def _numbered(number: int, far: socket.socket) -> tuple[int, int]:
    return number, int.from_bytes(far.recv(4), "big")


def test_a_packet_ends_a_wait(inbox: SocketInbox) -> None:
    near, far = _watched(inbox)
    began = time.monotonic()
    threading.Timer(0.02, near.send, (b"packet",)).start()
    assert inbox.get(LONG) == b"packet"
    assert time.monotonic() - began < LONG
    inbox.forget(far)
    near.close()
    far.close()


def test_items_and_packets_of_several_threads_all_arrive_in_the_order_of_each(inbox: SocketInbox) -> None:
    ends = [_watched(inbox) for _ in range(3)]

    def send(near: socket.socket) -> None:
        for number in range(EACH):
            near.send(number.to_bytes(4, "big"))

    def put(name: str) -> None:
        for number in range(EACH):
            inbox.put((name, number))

    threads = [threading.Thread(target=send, args=(near,)) for near, _ in ends]
    threads += [threading.Thread(target=put, args=(name,)) for name in ("one", "other")]
    for number, (_, far) in enumerate(ends):
        inbox.forget(far)
        inbox.watch(far, partial(_numbered, number, far))
    for thread in threads:
        thread.start()
    taken: dict[object, list[int]] = {}
    until = time.monotonic() + 60.0
    while sum(map(len, taken.values())) < 5 * EACH and time.monotonic() < until:
        item = inbox.get(0.01)
        if item is not None:
            taken.setdefault(item[0], []).append(item[1])
    for thread in threads:
        thread.join()
    assert sorted(map(str, taken)) == ["0", "1", "2", "one", "other"]
    assert all(numbers == list(range(EACH)) for numbers in taken.values())
    for near, far in ends:
        inbox.forget(far)
        near.close()
        far.close()


def test_a_taker_that_is_kept_busy_by_items_still_sees_packets(inbox: SocketInbox) -> None:
    near, far = _watched(inbox)
    near.send(b"packet")
    taken: list[object] = []
    for number in range(100):
        inbox.put(number)
        inbox.put(number)
        taken.append(inbox.get(LONG))
    assert b"packet" in taken or b"packet" in [inbox.get(LONG) for _ in range(101)]
    inbox.forget(far)
    near.close()
    far.close()


def test_what_is_forgotten_is_read_no_more(inbox: SocketInbox) -> None:
    near, far = _watched(inbox)
    near.send(b"packet")
    inbox.forget(far)
    inbox.forget(far)
    assert inbox.get(0.02) is None
    assert far.recv(100) == b"packet"
    near.close()
    far.close()


def test_an_end_that_closes_itself_while_another_is_read_does_no_harm(inbox: SocketInbox) -> None:
    (one, first), (other, second) = _watched(inbox), _watched(inbox)

    def end_both() -> str:
        for far in (first, second):
            inbox.forget(far)
        return "ended"

    for far in (first, second):
        inbox.forget(far)
        inbox.watch(far, end_both)
    one.send(b"packet")
    other.send(b"packet")
    assert inbox.get(LONG) == "ended"
    assert inbox.get(0.02) is None
    for end in (one, first, other, second):
        end.close()


def test_whoever_puts_something_may_do_so_while_the_taker_closes() -> None:
    for _ in range(300):
        inbox, failures = SocketInbox(), list[BaseException]()

        def put(inbox: SocketInbox = inbox, failures: list[BaseException] = failures) -> None:
            try:
                for number in range(20):
                    inbox.put(number)
            except OSError as error:
                failures.append(error)

        putting = threading.Thread(target=put)
        putting.start()
        while inbox.get(LONG) != 0:
            pass
        inbox.close()
        putting.join()
        assert failures == []
