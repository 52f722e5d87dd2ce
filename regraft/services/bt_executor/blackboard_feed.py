"""The mission's side of the system reflection (ReBeT, section IV): topics' values, on the root blackboard.

A tree decides on ``{@darkness}`` or ``{@battery_charge}`` without knowing their source. Each entry has its age,
``{@battery_charge_age}``, in seconds since the source's stamp, updated at each tick. Where the mapping has a limit,
``{@battery_charge_stale}`` is whether it is exceeded. An entry never received is empty, without age, and stale.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Final, Protocol

from behavior_tree import Blackboard, BlackboardError
from regraft.bus_schema.annotations import PlainValue
from regraft.bus_schema.messages.health import SensorHealth, SystemStatus
from regraft.bus_schema.messages.power import BatteryState
from regraft.bus_schema.messages.reflection import ReflectedEntry
from regraft.bus_schema.messages.sensors import LightLevel
from regraft.component.live_ports import Inputs

MAPPED: Final = "reflection"
"""The input that brings what the component ``system_reflection`` reads by the stack's mapping."""


@dataclass(frozen=True, slots=True)
class Reflected:
    """A blackboard entry from an input of the executor's own: its key and type, and how it is read from a message."""

    input: str
    key: str
    type: type
    read: Callable[[Any], Any]


def _charge(battery: BatteryState) -> float:
    return battery.charge


def _darkness(light: LightLevel) -> float:
    return light.darkness


def _problems(status: SystemStatus) -> str:
    return "; ".join(status.problems)


def _sensor_faults(health: SensorHealth) -> str:
    return "; ".join(f"{fault.topic} {fault.fault}" for fault in health.faults)


REFLECTED: Final = (
    Reflected("battery", "battery_charge", float, _charge),
    Reflected("light", "darkness", float, _darkness),
    Reflected("sensor_health", "sensor_faults", str, _sensor_faults),
    Reflected("system_status", "problems", str, _problems),
)
"""Charge of the battery and darkness, both as ratios in [0, 1]; what is wrong with the sensors, and altogether."""


class EventReporter(Protocol):
    """The listener for values that cannot be written."""

    def __call__(self, kind: str, text: str, **details: Any) -> None:
        """Something happened."""


class BlackboardFeed:
    """Writes each new value once, so that a node that waits for an update sees none that is not one."""

    def __init__(self, inputs: Inputs, reflected: Sequence[Reflected], tell: EventReporter) -> None:
        self._inputs = inputs
        self._reflected = reflected
        self._tell = tell
        self._entries: dict[str, ReflectedEntry] = {}
        self._seen: dict[str, object] = {}
        self._board: Blackboard | None = None
        self._written: dict[str, tuple[float | None, int]] = {}
        self._refused: set[str] = set()

    def declare(self, board: Blackboard) -> None:
        """Give a new root blackboard the entries of a known type, still empty; the next `update` fills them.

        The ports of the tree type the others. `declare_others` is for these, after the tree is made.
        """
        for own in self._reflected:
            board.declare(own.key, own.type)
        for entry in self._entries.values():
            if entry.value is not None:
                board.declare(entry.key, type(entry.value))

    def declare_others(self, board: Blackboard) -> None:
        """Give a root blackboard the entries whose type is not known yet."""
        for entry in self._entries.values():
            board.declare(entry.key)

    def update(self, board: Blackboard) -> None:
        """Write the entries that have something new, all for a board that was not written before, and every age."""
        if board is not self._board:
            self._board = board
            self._written.clear()
            self._refused.clear()
        self._look()
        now = board.clock.now()
        for entry in self._entries.values():
            try:
                self._write(board, entry, now)
            except BlackboardError as error:
                if entry.key not in self._refused:
                    self._refused.add(entry.key)
                    self._tell("reflection.refused", error.message)

    def _look(self) -> None:
        """Take what the inputs have; of an entry that is mapped too, the mapping holds."""
        for own in self._reflected:
            message = self._news(own)
            if message is not None:
                port = self._inputs[own.input]
                sequence = port.envelope.sequence if port.envelope else 0
                self._entries[own.key] = ReflectedEntry(own.key, own.read(message), port.stamp, sequence)
        reflection = self._inputs[MAPPED].latest
        for entry in reflection.entries if reflection else ():
            # A restarted source knows nothing at first: the known value is kept, and its age shows that it is old.
            if entry.stamp is not None or entry.key not in self._entries:
                self._entries[entry.key] = entry

    def _news(self, own: Reflected) -> Any:
        """Return the message of an entry's input if it has not been returned for that entry before."""
        message = self._inputs[own.input].latest
        if message is None or message is self._seen.get(own.key):
            return None
        self._seen[own.key] = message
        return message

    def _write(self, board: Blackboard, entry: ReflectedEntry, now: float) -> None:
        version = (entry.stamp, entry.sequence)
        if self._written.get(entry.key) != version:
            if entry.value is None:
                board.declare(entry.key)
            else:
                board.fix_type(entry.key)
                board.set(entry.key, entry.value)
                self._written[entry.key] = version
        age = None if entry.stamp is None else max(0.0, now - entry.stamp)
        if age is not None:
            board.set(f"{entry.key}_age", age)
        if entry.stale_after is not None:
            stale = age is None or age >= entry.stale_after
            known = board.find(f"{entry.key}_stale")
            if known is None or known.value is not stale:
                board.set(f"{entry.key}_stale", stale)

    # --- state ---

    def snapshot(self) -> PlainValue:
        """Return when the entries' values were true; the values are the blackboard's to keep."""
        known = (entry for entry in self._entries.values() if entry.stamp is not None)
        return {entry.key: [entry.stamp, entry.sequence, entry.stale_after] for entry in known}

    def restore(self, state: PlainValue) -> None:
        """Have the ages continue that `snapshot` returned."""
        for key, (stamp, sequence, stale_after) in state.items():
            self._entries.setdefault(key, ReflectedEntry(key, None, stamp, sequence, stale_after))
