"""Which keys a component reads and writes now, as the coordinator has to know it."""

from __future__ import annotations

from bus_schema.messages.clock import Wiring
from regraft.runtime.inputs import TopicReader
from regraft.runtime.runtime import Runtime


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


def same_wiring(one: Wiring | None, other: Wiring) -> bool:
    """Tell whether two wirings name the same keys, none of them anew, whatever their sequences."""
    if one is None or other.anew:
        return False
    return one.inputs == other.inputs and one.outputs.keys() == other.outputs.keys()
