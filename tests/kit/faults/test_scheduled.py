"""A fault on the schedule of a run happens in what the author has written: a handler, a service, a timer."""

from __future__ import annotations

from typing import Any

from regraft import Component, Quality, every
from regraft.bus_schema.encoding import codec
from regraft.bus_schema.messages.health import Event
from regraft.bus_schema.model.scheduled_faults import FaultKind, ScheduledFault
from tests.support.stepped.site import Site
from tests.support.waiting import PATIENCE, wait_until

EXCEPTION = ScheduledFault(0.0, "detector", FaultKind.EXCEPTION)


class Detector(Component):
    """Looks seldom; in between it is often measured, and its state kept."""

    seen = Quality("how much it has seen", minimum=0.0, estimated=False)
    checkpoint_every = 0.01
    evaluate_every = 0.01

    def __init__(self) -> None:
        self.looks = 0

    @every(seconds=0.3)
    def look(self) -> None:
        self.looks += 1

    def evaluate(self) -> dict[str, float]:
        return {"seen": float(self.looks)}

    def snapshot(self) -> int:
        return self.looks


def test_a_scheduled_exception_is_raised_by_a_timer_of_the_component_not_by_its_upkeep(site: Site) -> None:
    faults: list[str] = []
    bus = site.session()

    def take(item: Any) -> None:
        sample = bus.open_sample(item)
        if sample is not None:
            event = codec.decode(sample.payload, Event)
            faults.extend([event.text] if event.kind == "component.fault" else [])

    bus.subscribe(site.keys.event, take)
    site.start(Detector, "detector", faults=(EXCEPTION,))
    (answer,) = site.bus.query(site.keys.control("detector", 1, "fault"), codec.encode(EXCEPTION), PATIENCE)
    assert not answer.error
    wait_until(lambda: faults, "the fault to be reported")
    assert "look: InjectedFault" in faults[0]
