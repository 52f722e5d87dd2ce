"""A line of components that count what they pass on, and that fail where and how they are told to."""

from __future__ import annotations

import os
import time
from dataclasses import dataclass, field
from pathlib import Path

from regraft import Component, Input, Output, Parameter, every
from regraft.bus_schema.annotations import Count, PlainValue
from regraft.bus_schema.encoding.registry import message

LATE = 0.7
"""Seconds that somebody is late: more than the manager waits for an answer, less than a host takes for hung."""
FOR_EVER = 60.0


@message("failures/Number")
@dataclass(frozen=True, slots=True)
class Number:
    """The ``n``-th of what ``origin`` has told, and what it was multiplied by on its way."""

    origin: str
    n: Count
    gain: float = 1.0


class Source(Component):
    """Counts."""

    numbers = Output(Number)
    checkpoint_every = 0.1

    def __init__(self) -> None:
        self.n = 0

    @every(hz=100)
    def tell(self) -> None:
        self.n += 1
        self.numbers.publish(Number(self.kit.name, self.n))


class Relay(Component):
    """Passes numbers on. A file of its name in ``flags`` says how it shall fail, and in which of its methods, if not in
    any that is called next.
    """

    numbers = Input(Number, required=False)
    relayed = Output(Number, required=False)
    gain = Parameter(1.0, minimum=0.0, maximum=10.0)
    flags = Parameter("", "the folder of what shall go wrong", unit="path", read_only=True)
    handler_timeout = 1.0

    def __init__(self) -> None:
        self.passed = 0

    @numbers.handler
    def pass_on(self, number: Number) -> None:
        self.passed += 1
        self.relayed.publish(Number(number.origin, number.n, self.gain))

    def on_configure(self) -> None:
        self._fail_if_told("on_configure")

    def on_activate(self) -> None:
        self._fail_if_told("on_activate")

    def on_deactivate(self) -> None:
        self._fail_if_told("on_deactivate")

    def on_cleanup(self) -> None:
        self._fail_if_told("on_cleanup")

    def on_parameters(self, changed: frozenset[str]) -> None:
        self._fail_if_told("on_parameters")

    def snapshot(self) -> PlainValue:
        self._fail_if_told("snapshot")
        return {"passed": self.passed}

    def restore(self, state: PlainValue) -> None:
        self._fail_if_told("restore")
        self.passed = int(state["passed"])

    def _fail_if_told(self, method: str) -> None:
        flag = Path(self.flags) / self.kit.name
        try:
            how, where = flag.read_text().split(" in ")
            if where not in ("any", method):
                return
            flag.unlink()
        except OSError:
            return
        if how == "die":
            os._exit(9)
        if how == "refuse":
            raise RuntimeError("it does not want to")
        time.sleep(LATE if how == "late" else FOR_EVER)


class Loud(Relay):
    """Another class with the same ports and the same state."""

    gain = Parameter(2.0, minimum=0.0, maximum=10.0)
    loudness = Parameter(1, minimum=0, maximum=11)


@dataclass(slots=True)
class _Track:
    last: int = 0
    heard: int = 0
    lost: int = 0
    doubled: int = 0


@dataclass(slots=True)
class _Tracks:
    by_origin: dict[str, _Track] = field(default_factory=dict)

    def take(self, number: Number) -> None:
        track = self.by_origin.setdefault(number.origin, _Track(number.n - 1))
        track.heard += 1
        if number.n <= track.last:
            track.doubled += 1
        else:
            track.lost += number.n - track.last - 1
            track.last = number.n


class Meter(Component):
    """Counts what arrives at the end of each line: per line and origin what was heard, lost and doubled."""

    relayed = Input(Number)
    aside = Input(Number, required=False)
    away = Input(Number, required=False)

    def __init__(self) -> None:
        self.lines = {"relayed": _Tracks(), "aside": _Tracks(), "away": _Tracks()}

    @relayed.handler
    def take_relayed(self, number: Number) -> None:
        self.lines["relayed"].take(number)

    @aside.handler
    def take_aside(self, number: Number) -> None:
        self.lines["aside"].take(number)

    @away.handler
    def take_away(self, number: Number) -> None:
        self.lines["away"].take(number)

    def snapshot(self) -> PlainValue:
        return {
            line: {
                origin: {"heard": track.heard, "lost": track.lost, "doubled": track.doubled}
                for origin, track in tracks.by_origin.items()
            }
            for line, tracks in self.lines.items()
        }
