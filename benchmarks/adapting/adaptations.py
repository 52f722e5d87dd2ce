"""One adaptation of ten changes; and the manager killed, until it carries out an adaptation again."""

from __future__ import annotations

import os
import signal
import time

import zenoh

from benchmarks.harness import Effort, Result, compared, in_turns, percentile
from benchmarks.sides.links import wait_until
from benchmarks.sides.processes import Processes
from benchmarks.sides.raw import QUESTION, READY, answerer
from benchmarks.sides.system import MANAGER, System
from regraft.bus.zenoh_config import config
from regraft.bus_schema.model.adaptation import Change, ChangeState, Connect, SetParameters
from regraft.bus_schema.model.lifecycle import Transition

TENS, KILLS = 20, 12
TAIL = 0.95
BACK_TIMEOUT = 20.0
KILLED_OFTEN = "    restart: {limit: 1000, window: 1}\n"
TOPICS = """  numbers: {type: benchmark/Number}
  others: {type: benchmark/Number}
  spare: {type: benchmark/Number}
"""
COMPONENTS = """
  talker: {class: benchmarks.sides.counting:Talker, parameters: {rate: 10.0}}
  other: {class: benchmarks.sides.counting:Talker, parameters: {rate: 10.0}, connect: {numbers: others}}
  extra: {class: benchmarks.sides.counting:Talker, parameters: {rate: 10.0}, connect: {numbers: spare}}
  first: {class: benchmarks.sides.counting:Listener, connect: {heard: numbers}, services: {tell: tell_first}}
  second: {class: benchmarks.sides.counting:Listener, connect: {heard: numbers}, services: {tell: tell_second}}
  third: {class: benchmarks.sides.counting:Listener, connect: {heard: numbers}, services: {tell: tell_third}}
"""
NAMES = ("talker", "other", "extra", "first", "second", "third", "adaptation_manager")


def adaptations(effort: Effort) -> list[Result]:
    """Adapt in tens, beside ten queries one after another; then kill the manager again and again."""
    tens, kills = effort.count(TENS, least=2), effort.count(KILLS)
    with System(TOPICS, COMPONENTS + MANAGER + KILLED_OFTEN) as system, Processes() as processes:
        system.wait_for_components(*NAMES)
        processes.spawn(answerer, system.info.hub)
        session = zenoh.open(config(system.info.hub, lockstep=False))
        try:
            wait_until(lambda: list(session.liveliness().get(f"{READY}/answerer", timeout=1.0)), "the answerer")
            sides = in_turns(effort.rounds, lambda: _in_tens(system, tens), lambda: _ten_queries(session, tens))
        finally:
            session.close()  # type: ignore[no-untyped-call]
        back = [_kill_the_manager(system, number) for number in range(kills)]
    note = f"4 values, 3 connections, 3 transitions; {effort.rounds} rounds of {tens}"
    return [
        compared("an adaptation of ten changes", sides, "ms", "ten raw queries", None, scale=1e3, note=note),
        Result(
            "manager killed to next adaptation applied, p95",
            percentile(back, TAIL),
            "s",
            spread=(min(back), max(back)),
            note=f"{kills} kills; its host waits 0.05 s and more before each restart",
        ),
    ]


def _ten(flip: bool) -> tuple[Change, ...]:
    topic = "others" if flip else "numbers"
    transition = Transition.DEACTIVATE if flip else Transition.ACTIVATE
    return (
        *(SetParameters(name, {"gain": 0.25 + 0.5 * flip}) for name in ("talker", "other", "extra")),
        SetParameters("talker", {"rate": 10.0 + flip}),
        *(Connect(name, "heard", topic) for name in ("first", "second", "third")),
        ChangeState("extra", transition),
        *(ChangeState("extra", other) for other in (_opposite(transition), transition)),
    )


def _opposite(transition: Transition) -> Transition:
    return Transition.ACTIVATE if transition is Transition.DEACTIVATE else Transition.DEACTIVATE


def _in_tens(system: System, count: int) -> list[float]:
    took = []
    for number in range(2 * ((count + 1) // 2)):
        begun = time.perf_counter()
        system.adapt(*_ten(flip=number % 2 == 0))
        took.append(time.perf_counter() - begun)
    return took


def _ten_queries(session: zenoh.Session, count: int) -> list[float]:
    took = []
    for _ in range(count):
        begun = time.perf_counter()
        for _ in range(10):
            for reply in session.get(QUESTION, payload=bytes(100), timeout=5.0):
                assert reply.ok is not None
                reply.ok.payload.to_bytes()
        took.append(time.perf_counter() - begun)
    return took


def _kill_the_manager(system: System, number: int) -> float:
    """Kill it; returns the seconds until an adaptation asked for then has been applied by its next run."""
    process = system.processes()["adaptation_manager"]
    begun = time.monotonic()
    os.kill(process.pid, signal.SIGKILL)
    system.adapt(SetParameters("talker", {"gain": 0.3 + 0.4 * (number % 2)}))
    took = time.monotonic() - begun
    # Its host names the new run only with its next status.
    wait_until(lambda: system.processes()["adaptation_manager"].pid not in (0, process.pid), "a new run", BACK_TIMEOUT)
    return took
