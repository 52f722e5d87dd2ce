"""Which keys a component reads and writes now, as the coordinator has to know it."""

from __future__ import annotations

from regraft.bus_schema.messages.protocol.clock import Wiring
from regraft.runtime.data.inputs import TopicReader
from regraft.runtime.runtime import Runtime


class ReportedWiring:
    """The wiring of a component, and the part that the coordinator knows."""

    def __init__(self, runtime: Runtime) -> None:
        self._runtime = runtime
        self._told: Wiring | None = None

    def forget(self) -> None:
        """Take nothing for told: the coordinator is another one, or has lost sight of the component."""
        self._told = None

    def all(self) -> Wiring:
        """Return the wiring, which counts as told from now on."""
        return self._tell(wiring_of(self._runtime))

    def news(self) -> Wiring | None:
        """Return the wiring as ``all`` does if something else was told, None if not."""
        wiring = wiring_of(self._runtime)
        return None if _same(self._told, wiring) else self._tell(wiring)

    def _tell(self, wiring: Wiring) -> Wiring:
        self._told = wiring
        self._runtime.inbound.told(wiring.inputs)
        return wiring


def wiring_of(runtime: Runtime) -> Wiring:
    """Return what ``runtime`` reads (paused inputs excepted; true where it wakes) and writes."""
    inputs = {}
    for key, consumer in (*runtime.inbound.consumers.items(), *runtime.inbound.patterns.items()):
        if isinstance(consumer, TopicReader):
            if not consumer.paused:
                inputs[key] = consumer.wakes
        else:
            inputs[key] = True
    anew = tuple(key for key in runtime.inbound.anew if key in inputs)
    return Wiring(inputs, runtime.writers.sequences(), anew)


def _same(one: Wiring | None, other: Wiring) -> bool:
    """Return whether two wirings name the same keys, none of them again, whatever their sequences."""
    if one is None or other.anew:
        return False
    return one.inputs == other.inputs and one.outputs.keys() == other.outputs.keys()
