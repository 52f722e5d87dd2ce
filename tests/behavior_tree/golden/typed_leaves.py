"""Leaves with typed ports, for trees that were also given to BehaviorTree.CPP.

Each reads ``in``, logs its value as ``name:value`` and writes it to ``out`` where that is given. It logs ``name:!`` and
fails where it cannot read.
"""

from collections.abc import MutableSequence
from enum import IntEnum
from typing import Any

from behavior_tree import FAILURE, SUCCESS, Input, NodeSetup, Output, PortError, Registry, Status, SyncAction
from behavior_tree.data.values import number_text
from behavior_tree.scripted import scripted_registry
from behavior_tree.status import status_name


class Fault(IntEnum):
    NONE = 0
    LOW = 1
    BIG = 100


class _Pass(SyncAction):
    def __init__(self, setup: NodeSetup, events: MutableSequence[str]) -> None:
        super().__init__(setup)
        self._events = events

    @staticmethod
    def shown(value: Any) -> str:
        return str(value)

    def tick(self) -> Status:
        try:
            value = self.read_port("in")
        except PortError:
            self._events.append(f"{self.name}:!")
            return FAILURE
        self._events.append(f"{self.name}:{self.shown(value)}")
        if "out" in self.setup.writers:
            self.write_port("out", value)
        return SUCCESS


class PassInt(_Pass):
    given, result = Input(int, name="in"), Output(int, name="out")


class PassReal(_Pass):
    given, result = Input(float, name="in"), Output(float, name="out")

    @staticmethod
    def shown(value: Any) -> str:
        return number_text(float(value))


class PassBool(_Pass):
    given, result = Input(bool, name="in"), Output(bool, name="out")

    @staticmethod
    def shown(value: Any) -> str:
        return "true" if value else "false"


class PassText(_Pass):
    given, result = Input(str, name="in"), Output(str, name="out")


class PassInts(_Pass):
    given, result = Input(list[int], name="in"), Output(list[int], name="out")

    @staticmethod
    def shown(value: Any) -> str:
        return ";".join(map(str, value))


class PassReals(_Pass):
    given, result = Input(list[float], name="in"), Output(list[float], name="out")

    @staticmethod
    def shown(value: Any) -> str:
        return ";".join(map(number_text, value))


class PassTexts(_Pass):
    given, result = Input(list[str], name="in"), Output(list[str], name="out")

    @staticmethod
    def shown(value: Any) -> str:
        return ";".join(value)


class PassFault(_Pass):
    given = Input(Fault, name="in")

    @staticmethod
    def shown(value: Any) -> str:
        return str(int(value))


class PassStatus(_Pass):
    given = Input(Status, name="in")

    @staticmethod
    def shown(value: Any) -> str:
        return status_name(value)


class PassAny(_Pass):
    """Its ports have no type; it reads text or a number as text."""

    given, result = Input[Any](name="in"), Output[Any](name="out")

    def tick(self) -> Status:
        value = self.read_port_or("in")
        if value is None or isinstance(value, list):
            self._events.append(f"{self.name}:!")
            return FAILURE
        text = value if isinstance(value, str) else number_text(value)
        self._events.append(f"{self.name}:{text}")
        if "out" in self.setup.writers:
            self.write_port("out", text)
        return SUCCESS


def typed_registry(events: MutableSequence[str]) -> Registry:
    """Return a registry with the built-in types, the scripted and the typed leaves, which log into a list."""
    registry = scripted_registry(events)
    typed = (PassInt, PassReal, PassBool, PassText, PassInts, PassReals, PassTexts, PassFault, PassStatus, PassAny)
    for node_class in typed:
        registry.register(node_class, events=events)
    registry.register_enum(Fault)
    return registry
