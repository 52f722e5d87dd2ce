"""A port moves to another topic and back at a thousand messages a second: what is lost, doubled, disordered?

Three ports are moved. An input between two talkers: what it hears of either, between two moves, must have no hole.
An input between a talker and a silent source that speaks after each move. An output between two listeners: each
number must have been heard by one of them, once.
"""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass

from benchmarks.harness import Effort, Result
from benchmarks.sides.counting import Ask, Heard, Number
from benchmarks.sides.links import wait_until
from benchmarks.sides.system import MANAGER, System
from regraft.bus_schema.model.adaptation import Connect

MOVES, SILENT_MOVES = 300, 60
SETTLE = 0.3
TOPICS = "\n".join(f"  {name}: {{type: benchmark/Number}}" for name in ("one", "two", "silent", "left", "right"))
COMPONENTS = """
  first: {class: benchmarks.sides.counting:Talker, connect: {numbers: one}}
  second: {class: benchmarks.sides.counting:Talker, connect: {numbers: two}}
  speaker: {class: benchmarks.sides.counting:Speaker, connect: {numbers: silent}, services: {say: say}}
  mover: {class: benchmarks.sides.counting:Listener, connect: {heard: one}, services: {tell: mover/tell}}
  rover: {class: benchmarks.sides.counting:Talker, connect: {numbers: left}}
  lefty: {class: benchmarks.sides.counting:Listener, connect: {heard: left}, services: {tell: lefty/tell}}
  righty: {class: benchmarks.sides.counting:Listener, connect: {heard: right}, services: {tell: righty/tell}}
"""
NAMES = ("first", "second", "speaker", "mover", "rover", "lefty", "righty", "adaptation_manager")


@dataclass(slots=True)
class Faults:
    """What went wrong, in messages."""

    lost: int = 0
    doubled: int = 0
    disordered: int = 0

    def check_order(self, numbers: Iterable[int]) -> None:
        """Count what comes again, or later than a greater number."""
        seen: set[int] = set()
        greatest = 0
        for number in numbers:
            self.doubled += number in seen
            self.disordered += number not in seen and number < greatest
            seen.add(number)
            greatest = max(greatest, number)


def rewire(effort: Effort) -> list[Result]:
    """Move each port back and forth and count."""
    with System(TOPICS, COMPONENTS + MANAGER) as system:
        system.wait_for_components(*NAMES)
        return [
            *_input_between_talkers(system, effort.count(MOVES)),
            *_input_to_a_silent_source(system, effort.count(SILENT_MOVES)),
            *_output_between_listeners(system, effort.count(MOVES)),
        ]


def _results(what: str, faults: Faults, moves: int, heard: int, seconds: float) -> list[Result]:
    note = f"{moves} moves, {heard} messages, {seconds / moves * 1e3:.0f} ms a move"
    found = {"lost": faults.lost, "doubled": faults.doubled, "out of order": faults.disordered}
    return [Result(f"{what}: {name}", count, "messages", limit=0.0, note=note) for name, count in found.items()]


def _input_between_talkers(system: System, moves: int) -> list[Result]:
    _listen_anew(system, "mover")
    begun = time.monotonic()
    for number in range(moves):
        system.adapt(Connect("mover", "heard", ("two", "one")[number % 2]))
    seconds = time.monotonic() - begun
    heard = _tell(system, "mover")
    faults = Faults()
    for source in ("first", "second"):
        faults.check_order(n for who, n in zip(heard.sources, heard.numbers, strict=True) if who == source)
    for run in _runs(heard):
        faults.lost += max(run) - min(run) + 1 - len(set(run))
    return _results("rewire an input, busy", faults, moves, len(heard.numbers), seconds)


def _runs(heard: Heard) -> list[list[int]]:
    """Return the numbers heard of one source without another in between."""
    runs: list[list[int]] = []
    last = ""
    for source, number in zip(heard.sources, heard.numbers, strict=True):
        if source != last:
            runs.append([])
        runs[-1].append(number)
        last = source
    return runs


def _input_to_a_silent_source(system: System, moves: int) -> list[Result]:
    said = []
    heard: list[int] = []
    begun = time.monotonic()
    for number in range(moves):
        system.adapt(Connect("mover", "heard", ("silent", "one")[number % 2]))
        if number % 2 == 0:
            said.append(system.call("say", Ask(), Number).value)
    seconds = time.monotonic() - begun
    time.sleep(SETTLE)
    told = _tell(system, "mover")
    heard = [n for who, n in zip(told.sources, told.numbers, strict=True) if who == "speaker"]
    faults = Faults(lost=len(set(said) - set(heard)))
    faults.check_order(heard)
    return _results("rewire an input, silent", faults, moves, len(said), seconds)


def _output_between_listeners(system: System, moves: int) -> list[Result]:
    for listener in ("lefty", "righty"):
        _listen_anew(system, listener)
    begun = time.monotonic()
    for number in range(moves):
        system.adapt(Connect("rover", "numbers", ("right", "left")[number % 2]))
    seconds = time.monotonic() - begun
    if moves % 2:
        system.adapt(Connect("rover", "numbers", "left"))
    time.sleep(SETTLE)
    # The left one goes on hearing while it is asked, so it is asked last.
    right, left = _tell(system, "righty").numbers, _tell(system, "lefty").numbers
    faults = Faults()
    faults.check_order(left)
    faults.check_order(right)
    counts = Counter([*left, *right])
    faults.doubled += len(set(left) & set(right))
    faults.lost = max(counts) - min(counts) + 1 - len(counts)
    return _results("rewire an output, busy", faults, moves, len(left) + len(right), seconds)


def _listen_anew(system: System, listener: str) -> None:
    _tell(system, listener)
    if listener != "righty":
        wait_until(lambda: _tell(system, listener).numbers, f"{listener} hears something")
        _tell(system, listener)


def _tell(system: System, listener: str) -> Heard:
    return system.call(f"{listener}/tell", Ask(), Heard)
