"""Which runs of components the hosts know: they start them, so no other run is one."""

from __future__ import annotations

from collections.abc import Iterable

from regraft.bus.interface import Answer, Bus
from regraft.bus_schema.encoding import codec
from regraft.bus_schema.errors import BadMessage
from regraft.bus_schema.keys import Keys
from regraft.bus_schema.messages.protocol.host import HostStatus

MAX_DIGITS = 10
"""Digits of an incarnation at the most: messages carry it in 32 bits, and Python reads no number of 5,000 digits."""

Run = tuple[str, int]
"""A component's name and incarnation."""

Runs = dict[str, set[int]]
"""The incarnations of components, by name."""


def ask_hosts(bus: Bus, keys: Keys, timeout: float) -> list[HostStatus]:
    """Return the status of all hosts that answer in ``timeout`` seconds; raises BusError."""
    answers = bus.query(keys.host("*", "runs"), b"", timeout, all_of_them=True)
    return [status for status in map(_read, answers) if status is not None]


def _read(answer: Answer) -> HostStatus | None:
    try:
        return None if answer.error else codec.decode(answer.payload, HostStatus)
    except BadMessage:
        return None


def newest_run(told: Iterable[HostStatus], component: str) -> int | None:
    """Return the newest run of a component that hosts report, None if none has the component."""
    found = [
        max(process.incarnation, process.max_incarnation)
        for status in told
        for process in (*status.processes, *status.beside, *(p for other in status.others for p in other.processes))
        if process.component == component
    ]
    return max(found, default=None)


def run_of(token: str) -> Run | None:
    """Return the run whose liveliness token has this key, None if no run has it."""
    name, _, number = token.split("/")[-3:]
    fits = number.isascii() and number.isdecimal() and len(number) <= MAX_DIGITS
    return (name, int(number)) if fits else None


def runs_shown(tokens: Iterable[str]) -> Runs:
    """Return the runs that liveliness tokens show; a token that names no run is nobody's."""
    runs: Runs = {}
    for name, incarnation in filter(None, map(run_of, tokens)):
        runs.setdefault(name, set()).add(incarnation)
    return runs


def living_runs(bus: Bus, keys: Keys, tokens: Iterable[str], timeout: float) -> dict[str, int]:
    """Return the newest living run of each component; where several show a token, the newest that hosts know."""
    runs = runs_shown(tokens)
    doubtful = [name for name, shown in runs.items() if len(shown) > 1]
    told = ask_hosts(bus, keys, timeout) if doubtful else []
    for name in doubtful:
        newest = newest_run(told, name)
        if newest is not None:
            runs[name] = {run for run in runs[name] if run <= newest} or runs[name]
    return {name: max(shown) for name, shown in runs.items()}
