"""Set a parameter through the adaptation manager, with check, journal and verification; against one raw query."""

from __future__ import annotations

import time

import zenoh

from benchmarks.harness import Effort, Result, compared, in_turns
from benchmarks.sides.links import wait_until
from benchmarks.sides.processes import Processes
from benchmarks.sides.raw import QUESTION, READY, answerer
from benchmarks.sides.system import MANAGER, System
from regraft.bus.zenoh_config import config
from regraft.bus_schema.model.adaptation import SetParameters

COUNT = 60
LIMIT = 4.0
TAIL = 0.95
PAUSE = 0.01
"""Seconds between two, on either side: what the one before told everybody is over when the next begins."""
TOPICS = "  numbers: {type: benchmark/Number}"
COMPONENTS = """
  talker: {class: benchmarks.sides.counting:Talker, parameters: {rate: 10.0}}
"""


def set_parameter(effort: Effort) -> list[Result]:
    """Set a parameter of a running component again and again."""
    count = effort.count(COUNT, least=3)
    with System(TOPICS, COMPONENTS + MANAGER) as system, Processes() as processes:
        system.wait_for_components("talker", "adaptation_manager")
        processes.spawn(answerer, system.info.hub)
        session = zenoh.open(config(system.info.hub, lockstep=False))
        try:
            wait_until(lambda: list(session.liveliness().get(f"{READY}/answerer", timeout=1.0)), "the answerer")
            sides = in_turns(effort.rounds, lambda: _adaptations(system, count), lambda: _queries(session, count))
        finally:
            session.close()  # type: ignore[no-untyped-call]
    note = f"{effort.rounds} rounds of {count}"
    against = "one raw zenoh query"
    return [
        compared("set a parameter, p95", sides, "ms", against, LIMIT, share=TAIL, scale=1e3, note=note),
        compared("set a parameter, median", sides, "ms", against, None, scale=1e3, note=note),
    ]


def _adaptations(system: System, count: int) -> list[float]:
    took = []
    for number in range(count):
        time.sleep(PAUSE)
        begun = time.perf_counter()
        system.adapt(SetParameters("talker", {"gain": 0.25 + 0.5 * (number % 2)}))
        took.append(time.perf_counter() - begun)
    return took


def _queries(session: zenoh.Session, count: int) -> list[float]:
    took = []
    for _ in range(count):
        time.sleep(PAUSE)
        begun = time.perf_counter()
        for reply in session.get(QUESTION, payload=bytes(100), timeout=5.0):
            assert reply.ok is not None
            reply.ok.payload.to_bytes()
        took.append(time.perf_counter() - begun)
    return took
