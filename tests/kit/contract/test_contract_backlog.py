"""However much was kept for a component, it keeps its heartbeat while it handles that."""

from __future__ import annotations

import time

from regraft import Component, Input
from regraft.bus_schema.encoding import codec
from regraft.bus_schema.encoding.envelope import is_marker
from regraft.bus_schema.messages.protocol.control import Rewire, RewireStep, SetTransition
from regraft.bus_schema.model.lifecycle import Transition
from regraft.runtime.core.overlap import MAX_OVERLAPPING
from regraft.runtime.data.writers import Writer
from tests.kit.parts import Number
from tests.support.stepped.site import Site
from tests.support.waiting import PATIENCE, wait_until

KEPT = 60
LASTS = 0.02
HEARTBEAT = 0.05


class Careful(Component):
    """Takes its time for each number."""

    heard = Input(Number)

    def __init__(self) -> None:
        self.handled: list[int] = []

    @heard.handler
    def take(self, number: Number) -> None:
        time.sleep(LASTS)  # the work itself: nothing is waited for
        self.handled.append(number.value)


class Prompt(Component):
    """Is done with each number at once, but by a task."""

    heard = Input(Number)

    def __init__(self) -> None:
        self.handled: list[int] = []

    @heard.handler
    async def take(self, number: Number) -> None:
        self.handled.append(number.value)


def _beats(site: Site, careful: Careful) -> list[int]:
    """Return how many numbers were handled at each heartbeat, from now on."""
    beats: list[int] = []
    bus = site.session()

    def take(item: object) -> None:
        sample = bus.open_sample(item)
        if sample is not None and not is_marker(sample.attachment):
            beats.append(len(careful.handled))

    bus.subscribe(site.keys.status("careful"), take)
    return beats


def _put(site: Site, writer: Writer, many: int = KEPT) -> None:
    """Put numbers, and wait until they are with the component."""
    assert writer.wait_for_reader(PATIENCE)
    writer.mark()
    for number in range(many):
        writer.put(codec.encode(Number(number)))
    inbound = site.runtimes["careful"].inbound
    wait_until(lambda: inbound.stream(writer.key, "source").handled == writer.sequence, "all to have come")


def _handles_all_and_beats(careful: Careful, beats: list[int]) -> None:
    wait_until(lambda: len(careful.handled) >= KEPT, "all to be handled")
    assert careful.handled == [*range(KEPT)]
    between = {handled for handled in beats if 0 < handled < KEPT}
    assert len(between) > 5, "more than could be on their way when it began"


def test_one_that_goes_on_keeps_its_heartbeat_while_it_handles_what_it_has_missed(site: Site) -> None:
    careful = site.start(Careful, "careful", heartbeat=HEARTBEAT)
    beats = _beats(site, careful)
    site.client.control("careful", "transition", SetTransition(Transition.DEACTIVATE, hold=True))
    _put(site, site.writer("heard", Number))
    site.client.control("careful", "transition", SetTransition(Transition.ACTIVATE))
    _handles_all_and_beats(careful, beats)


def test_an_input_that_has_moved_keeps_the_heartbeat_while_it_handles_what_waited_for_that(site: Site) -> None:
    careful = site.start(Careful, "careful", heartbeat=HEARTBEAT)
    beats = _beats(site, careful)
    site.client.control("careful", "connections", Rewire(RewireStep.OPEN, "heard", "other"))
    _put(site, site.writer("other", Number))
    site.client.control("careful", "connections", Rewire(RewireStep.SWITCH, "heard", "other"))
    _handles_all_and_beats(careful, beats)


def test_one_that_goes_on_misses_nothing_however_much_was_kept(site: Site) -> None:
    prompt, many = site.start(Prompt, "careful"), MAX_OVERLAPPING + 100
    site.client.control("careful", "transition", SetTransition(Transition.DEACTIVATE, hold=True))
    _put(site, site.writer("heard", Number), many)
    site.client.control("careful", "transition", SetTransition(Transition.ACTIVATE))
    wait_until(lambda: len(prompt.handled) >= many, "all to be handled")
    assert prompt.handled == [*range(many)]
