"""Leaves whose results are spelt out in the XML, as the reference driver of the golden traces had them."""

from services.bt_executor.engine import (
    FAILURE,
    RUNNING,
    SKIPPED,
    SUCCESS,
    Condition,
    Input,
    Node,
    NodeSetup,
    Output,
    Registry,
    StatefulAction,
    Status,
    SyncAction,
)

LETTERS = "IRSFK"
_RESULTS = {"R": RUNNING, "S": SUCCESS, "F": FAILURE, "K": SKIPPED}


class _Spelt(Node):
    """Returns the letters of its script in turn and logs each; `out` gets `in` with the letter added."""

    script = Input(str)
    input_text = Input(str, name="in")
    output_text = Output(str, name="out")

    def __init__(self, setup: NodeSetup, events: list[str]) -> None:
        super().__init__(setup)
        self._events = events
        self._next = 0

    def next_result(self) -> Status:
        script = self.script
        letter = script[self._next % len(script)]
        self._next += 1
        self._events.append(f"{self.name}:{letter}")
        text = self.read_port_or("in")
        if text is not None:
            self.output_text = text + letter
        return _RESULTS[letter]


class Scripted(_Spelt, StatefulAction):
    def on_start(self) -> Status:
        return self.next_result()

    def on_running(self) -> Status:
        return self.next_result()

    def on_halted(self) -> None:
        self._events.append(f"{self.name}:H")


class ScriptedCond(_Spelt, Condition):
    def tick(self) -> Status:
        return self.next_result()


class ScriptedSync(_Spelt, SyncAction):
    def tick(self) -> Status:
        return self.next_result()


def scripted_registry(events: list[str]) -> Registry:
    """Return a registry with the three leaves, which log into a list."""
    registry = Registry()
    for node_class in (Scripted, ScriptedCond, ScriptedSync):
        registry.register(node_class, events=events)
    return registry
