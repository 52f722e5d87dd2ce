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
        known = not anew and self._told is not None and self._told.inputs == inputs
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


def _wiring(runtime: Runtime, inputs: dict[str, bool], anew: tuple[str, ...]) -> Wiring:
    return Wiring(inputs, runtime.writers.sequences(), tuple(key for key in anew if key in inputs))


def _read(runtime: Runtime) -> dict[str, bool]:
    inbound = runtime.inbound
    consumers = {**inbound.consumers, **inbound.patterns} if inbound.patterns else inbound.consumers
    return {key: consumer.wakes for key, consumer in consumers.items() if not consumer.paused}
