"""A component is swapped at a thousand messages a second; beside it, the same done by hand with raw Zenoh.

By hand there are two ways: *break before make* ends the old process and starts the new one, *make before break* the
other way round. Neither hands over what the old one knows, nor what is on its way.
"""

from __future__ import annotations

import multiprocessing
from multiprocessing.connection import Connection

import zenoh

from benchmarks.harness import Effort, Result
from benchmarks.sides.ear import COMPONENTS, RATE, TOPICS, Ear, Handed, heard, results
from benchmarks.sides.links import UP_TIMEOUT, wait_until
from benchmarks.sides.processes import Processes
from benchmarks.sides.raw_swap import NUMBER, OUT, SERVING, relays, source
from benchmarks.sides.system import MANAGER, System
from regraft.bus.zenoh_config import Endpoints, config
from regraft.bus_schema.model.adaptation import Swap

SWAPS, BY_HAND = 60, 20
SWAP_LIMIT, GAP_LIMIT = 100.0, 20.0
CLASSES = ("benchmarks.sides.counting:OtherRelay", "benchmarks.sides.counting:Relay")


def swap(effort: Effort) -> list[Result]:
    """Swap through the manager, then by hand in both ways."""
    with System(TOPICS, COMPONENTS + MANAGER) as system, Processes() as processes:
        system.wait_for_components("talker", "relay", "adaptation_manager")
        session = zenoh.open(config(system.info.hub, lockstep=False))
        try:
            ours = _through_the_manager(system, session, effort.count(SWAPS, least=2))
            by_hand = effort.count(BY_HAND, least=2)
            hand = _Hand(system.info.hub, session, processes)
            broken = hand.swaps(by_hand, make_first=False)
            made = hand.swaps(by_hand, make_first=True)
        finally:
            session.close()  # type: ignore[no-untyped-call]
    return [
        *results("swap", ours, SWAP_LIMIT, GAP_LIMIT, 0),
        *results("by hand, break before make", broken, None, None, None),
        *results("by hand, make before break", made, None, None, None),
    ]


def _through_the_manager(system: System, session: zenoh.Session, count: int) -> Handed:
    system.adapt(Swap("relay", CLASSES[0]))  # the first imports what the others have imported
    with heard(session, "passed") as ear:
        both = [
            ear.around(lambda number=number: system.adapt(Swap("relay", CLASSES[(number + 1) % 2])))  # type: ignore[misc]
            for number in range(count)
        ]
    return Handed.of(both, ear)


class _Hand:
    """Relays that are started and ended by hand."""

    def __init__(self, hub: Endpoints, session: zenoh.Session, processes: Processes) -> None:
        self._session = session
        self._number = 0
        self._pipe: Connection
        self._pipe, theirs = multiprocessing.get_context("spawn").Pipe()
        processes.spawn(relays, hub, theirs)
        processes.spawn(source, hub, RATE)
        self._start()

    def swaps(self, count: int, *, make_first: bool) -> Handed:
        ear = Ear()
        subscriber = self._session.declare_subscriber(
            OUT, lambda sample: ear.take(NUMBER.unpack(sample.payload.to_bytes())[0])
        )
        both = [ear.around(self._make_first if make_first else self._break_first) for _ in range(count)]
        subscriber.undeclare()  # type: ignore[no-untyped-call]
        return Handed.of(both, ear)

    def _make_first(self) -> None:
        former = self._number
        self._start()
        self._tell("stop", former)

    def _break_first(self) -> None:
        self._tell("stop", self._number)
        self._start()

    def _start(self) -> None:
        self._number += 1
        self._tell("start", self._number)
        token = f"{SERVING}/{self._number}"
        wait_until(lambda: list(self._session.liveliness().get(token, timeout=1.0)), f"relay {self._number}")

    def _tell(self, verb: str, number: int) -> None:
        self._pipe.send((verb, number))
        if not self._pipe.poll(UP_TIMEOUT):
            raise TimeoutError(f"relay {number} was not told of: {verb}")
        self._pipe.recv()
