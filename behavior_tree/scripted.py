"""Leaves whose results are spelt out in the XML, for traces and for tests.

``script`` has one letter for each tick of the leaf itself: R running, S success, F failure, K skipped. It is read over
and over; neither a halt nor a new start restarts it. Where ``in`` can be read, ``out`` gets it with the letter behind.
"""

from collections.abc import MutableSequence
from typing import Final

from .node_registry import Registry
from .nodes.leaf import Condition, StatefulAction, SyncAction
from .nodes.node import Node, NodeSetup
from .nodes.ports import Input, Output
from .status import FAILURE, RUNNING, SKIPPED, SUCCESS, Status

LETTERS: Final = "IRSFK"
"""The letter of each status."""

_RESULTS: Final = {"R": RUNNING, "S": SUCCESS, "F": FAILURE, "K": SKIPPED}


class _Spelt(Node):
    """The base of the three leaves; events are logged as ``name:letter``, a halt as ``name:H``."""

    script = Input(str, description="the results, a letter each")
    input_text = Input(str, name="in", description="text to pass on")
    output_text = Output(str, name="out", description="that text and the letter")

    def __init__(self, setup: NodeSetup, events: MutableSequence[str]) -> None:
        super().__init__(setup)
        self._events = events
        self._next = 0

    def adopt(self, children: tuple[Node, ...]) -> None:
        """Check a script that is given as a literal."""
        super().adopt(children)
        if self.has_literal("script"):
            self._checked(self.script)

    def next_result(self) -> Status:
        """Log the next letter, pass the text on, and return the letter's status."""
        script = self._checked(self.script)
        letter = script[self._next % len(script)]
        self._next += 1
        self._events.append(f"{self.name}:{letter}")
        text = self.read_port_or("in")
        if text is not None and "out" in self.setup.writers:
            self.output_text = text + letter
        return _RESULTS[letter]

    @staticmethod
    def _checked(script: str) -> str:
        if not script or set(script) - set(_RESULTS):
            raise ValueError(f"script '{script}': a script is one or more of the letters {', '.join(_RESULTS)}")
        return script


class Scripted(_Spelt, StatefulAction):
    """An action that takes as many ticks as its script states."""

    def on_start(self) -> Status:
        """Return the next letter's status."""
        return self.next_result()

    def on_running(self) -> Status:
        """Return the next letter's status."""
        return self.next_result()

    def on_halted(self) -> None:
        """Log the halt."""
        self._events.append(f"{self.name}:H")


class ScriptedCond(_Spelt, Condition):
    """A condition."""

    def tick(self) -> Status:
        """Return the next letter's status."""
        return self.next_result()


class ScriptedSync(_Spelt, SyncAction):
    """A synchronous action; the letter R is an error."""

    def tick(self) -> Status:
        """Return the next letter's status."""
        return self.next_result()


def scripted_registry(events: MutableSequence[str]) -> Registry:
    """Return a registry with the built-in types and the three leaves, which log into a list."""
    registry = Registry()
    for node_class in (Scripted, ScriptedCond, ScriptedSync):
        registry.register(node_class, events=events)
    return registry
