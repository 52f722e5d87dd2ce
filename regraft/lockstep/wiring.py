"""Which keys a component reads and writes now, as the coordinator has to know it."""

from __future__ import annotations

from regraft.bus_schema.messages.protocol.clock import Wiring
from regraft.runtime.runtime import Runtime


class ReportedWiring:
    """The wiring of a component, and the part that the coordinator knows."""

    def __init__(self, runtime: Runtime) -> None:
        self._runtime = runtime
        self._told: Wiring | None = None
        self._told_outputs: frozenset[str] = frozenset()

    def forget(self) -> None:
        """Take nothing for sent: the coordinator is another one, or has lost sight of the component."""
        self._told = None

    def all(self) -> Wiring:
        """Return the wiring, which counts as sent from now on."""
        return self._tell(wiring_of(self._runtime))

    def news(self) -> Wiring | None:
        """Return the wiring as ``all`` does if it has changed since, None if not: asked for after every step."""
        runtime = self._runtime
        inputs, anew = _read(runtime), runtime.inbound.anew
        told, on_demand = self._told, _on_demand(runtime, inputs)
        known = not anew and told is not None and told.inputs == inputs and told.on_demand == on_demand
        if known and self._told_outputs == runtime.writers.open_keys.keys():
            return None
        return self._tell(_wiring(runtime, inputs, anew))

    def _tell(self, wiring: Wiring) -> Wiring:
        self._told, self._told_outputs = wiring, frozenset(wiring.outputs)
        self._runtime.inbound.told(wiring.inputs)
        return wiring


def wiring_of(runtime: Runtime) -> Wiring:
    """Return what ``runtime`` reads (paused inputs excepted; true where it wakes) and writes."""
    return _wiring(runtime, _read(runtime), runtime.inbound.anew)


def note_wanted(runtime: Runtime, keys: tuple[str, ...]) -> None:
    """Have the outputs know which of them members read."""
    for output in runtime.outputs.values():
        output.wanted_in_step = output.key in keys


def _wiring(runtime: Runtime, inputs: dict[str, bool], anew: tuple[str, ...]) -> Wiring:
    read_again = tuple(key for key in anew if key in inputs)
    return Wiring(inputs, runtime.writers.sequences(), read_again, _on_demand(runtime, inputs))


def _on_demand(runtime: Runtime, inputs: dict[str, bool]) -> tuple[str, ...]:
    on_demand = runtime.inbound.on_demand
    return tuple(sorted(key for key in on_demand if key in inputs)) if on_demand else ()


def _read(runtime: Runtime) -> dict[str, bool]:
    inbound = runtime.inbound
    consumers = {**inbound.consumers, **inbound.patterns} if inbound.patterns else inbound.consumers
    return {key: consumer.wakes for key, consumer in consumers.items() if not consumer.paused}
