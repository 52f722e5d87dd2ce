"""The loop of a component under simulated time: it works when the coordinator gives it a step, and acknowledges.

Between steps it answers control queries and keeps its heartbeat; its clock is still.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace
from typing import Any

from regraft.bus.interface import Presence, Sample
from regraft.bus_schema.encoding import codec
from regraft.bus_schema.errors import BadMessage
from regraft.bus_schema.messages.protocol.clock import Ack, Join, MarkerAck, SlotRequest, Step, StepKind
from regraft.bus_schema.model.lifecycle import State
from regraft.bus_schema.model.system_topics import SYSTEM_TOPICS
from regraft.lockstep.clock_publisher import ClockPublisher
from regraft.lockstep.exclusive_slot import hold_slot
from regraft.lockstep.step_links.member_link import MemberLink
from regraft.lockstep.wiring import ReportedWiring, note_wanted, wiring_of
from regraft.patience import Patience
from regraft.runtime.core.clock import SteppedClock
from regraft.runtime.data.own_news import OwnNews
from regraft.runtime.data.stream import Stream
from regraft.runtime.loop import reach
from regraft.runtime.runtime import Runtime

JOIN_INTERVAL = 0.5
IDLE_JOIN_TIMEOUT = 2.0
SLOT_REQUEST_INTERVAL = 0.2
INPUTS_TIMEOUT = 8.0
"""Seconds that a step waits for its inputs; what has not come by then is reported as lost."""
ASK_TIMEOUT = 0.1
"""Seconds after which writers are asked to send again what has not come."""
NOT_COME = "some of the messages that were to be handled have not come"


class Member:
    """One component in step."""

    def __init__(self, runtime: Runtime, clock: SteppedClock) -> None:
        self._runtime = runtime
        self._clock = clock
        self._publisher = ClockPublisher(runtime.bus)
        self._link = MemberLink(runtime, self._take_step)
        self._keys = runtime.keys
        self._name = runtime.assignment.name
        self._step: Step | None = None
        self._begun = 0
        self._stepped_as = self._incarnation
        self._last_ack: Ack | None = None
        self._wiring = ReportedWiring(runtime)
        self._source_reads: tuple[str, ...] = ()
        self._started = False
        self._configured_to = runtime.state
        self._next_join = 0.0
        self._joined_as = 0
        self._next_slot_request = 0.0
        self._news = runtime.reporter.news = OwnNews()
        self._relayed = {runtime.keys.topic(topic): topic for topic in SYSTEM_TOPICS}

    @property
    def _incarnation(self) -> int:
        """As which this run is known now: one that was handed over from and continues again has a new one."""
        return self._runtime.assignment.incarnation

    def run(self) -> None:
        """Join and work until the component is finalized."""
        runtime = self._runtime
        runtime.take_in = self._shelve
        step_key = self._keys.clock(f"step/{self._name}")
        runtime.direct[step_key] = self._take_sample
        declared = [runtime.bus.subscribe(step_key, runtime.inbox.put)]
        if runtime.assignment.succeeds is None:
            runtime.declare()
            self._configure()
        else:
            runtime.handover.stand_by()
            self._started = True
        runtime.marker_listeners.append(self._saw_marker)
        declared.append(
            runtime.bus.watch(self._keys.clock("alive/*"), lambda p: runtime.post(lambda: self._coordinator(p)))
        )
        while runtime.state is not State.FINALIZED:
            if self._step is None:
                self._pump_once()
            if self._step is not None:
                step, self._step = self._step, None
                self._perform(step)
            self._join_if_due()
            self._request_slot_if_due()
        for closable in declared:
            closable.close()
        self._link.close()
        self._publisher.close()

    def _shelve(self, item: Any) -> None:
        """Take in a topic's message, on the bus's thread: it is handled in its step, not before.

        A marker, which alone is empty, is waited for now.
        """
        self._runtime.inbox.put_lazy(item)
        if not len(item.payload):
            self._runtime.inbox.put(None)

    def _configure(self) -> None:
        if self._runtime.assignment.state in (State.INACTIVE, State.ACTIVE):
            reach(self._runtime, State.INACTIVE)
        self._configured_to = self._runtime.state

    # --- joining ---

    def _coordinator(self, presence: Presence) -> None:
        """A new coordinator knows nobody: join at once."""
        if presence.present:
            self._next_join = 0.0

    def _join_if_due(self) -> None:
        if time.monotonic() < self._next_join and self._joined_as == self._incarnation:
            return
        self._joined_as = self._incarnation
        self._next_join = time.monotonic() + (IDLE_JOIN_TIMEOUT if self._last_ack else JOIN_INTERVAL)
        wiring = wiring_of(self._runtime)
        join = Join(
            self._name,
            self._incarnation,
            self._runtime.identity.epoch,
            wiring,
            self._next_wake(),
            self._clock.now(),
            self._runtime.slots.wanted,
        )
        self._publisher.put(self._keys.clock("join"), join)

    def _next_wake(self) -> int | None:
        if not self._started:
            return 0
        return self._runtime.timers.next_due()

    def _saw_marker(self, key: str, source: str, stream: Stream) -> None:
        ack = MarkerAck(self._name, self._incarnation, key, source, stream.handled or 0)
        self._publisher.put(self._keys.clock("marker_ack"), ack)

    def _request_slot_if_due(self) -> None:
        """Ask for a slot for what has come from sources that are no members."""
        if time.monotonic() < self._next_slot_request:
            return
        outside = self._runtime.inbound.outsiders()
        if outside:
            self._next_slot_request = time.monotonic() + SLOT_REQUEST_INTERVAL
            self._publisher.put(self._keys.clock("slot_request"), SlotRequest(self._name, self._incarnation, outside))

    # --- steps ---

    def _take_sample(self, sample: Sample) -> None:
        self._take_step(sample.payload, over_bus=True)

    def _take_step(self, payload: bytes, *, over_bus: bool = False) -> None:
        """Take a step. For a new one that comes over the bus the source has no link to this run: it gets another."""
        try:
            step = codec.decode(payload, Step)
        except BadMessage as error:
            self._runtime.reporter.refused("step", "coordinator", str(error))
            return
        if step.incarnation != self._incarnation:
            return
        if step.incarnation != self._stepped_as:
            # The steps of the run between, which this one had handed over to, were not numbered with its own.
            self._stepped_as, self._begun, self._last_ack = step.incarnation, 0, None
        is_new = step.kind is StepKind.WELCOME or step.number > self._begun
        if over_bus and is_new:
            self._link.renew()
        if self._last_ack is not None and step.number == self._last_ack.number:
            self._answer(self._last_ack)
        elif is_new:
            self._begun = step.number
            self._step = step

    def _perform(self, step: Step) -> None:
        self._runtime.tick = step.tick
        self._next_join = time.monotonic() + IDLE_JOIN_TIMEOUT
        error = ""
        touched: tuple[str, ...] = ()
        if step.kind is StepKind.WELCOME:
            self._clock.advance_to(step.time)
            self._runtime.inbound.forget_all()
            self._runtime.writers.advanced.clear()
            self._wiring.forget()
            self._news.forget()
        elif step.kind is StepKind.MARK:
            self._mark(step.marks)
        elif step.kind is StepKind.STEP:
            self._runtime.writers.defers = True
            error = self._work(step)
        elif step.kind is StepKind.REPORT:
            self._settle()  # a run that took over in the slot may have begun heavy work
        elif step.kind is StepKind.SLOT:
            self._clock.advance_to(step.time)
            touched = hold_slot(self._runtime, step.outside, self._pump_and_work, self._settle)
            self._next_slot_request = 0.0
        self._acknowledge(step, touched, error)
        self._runtime.writers.defers = False
        self._runtime.writers.flush()

    def _mark(self, keys: tuple[str, ...]) -> None:
        for key in keys:
            writer = self._runtime.writers.open_keys.get(key)
            if writer:
                writer.mark()

    def _work(self, step: Step) -> str:
        runtime = self._runtime
        runtime.inbound.forget_sources(step.gone)
        runtime.end_goals_of(step.ended)
        if step.wanted is not None:
            note_wanted(runtime, step.wanted)
            self._source_reads = step.source_reads
            self._news.want([topic for key, topic in self._relayed.items() if key in step.wanted])
        runtime.inbound.arrive_early(step.samples)
        error = self._wait_for(step)
        self._clock.advance_to(step.time)
        runtime.inbound.release(step.frontier)
        if not self._started:
            self._started = True
            # A component that has changed its state before its first step has decided otherwise.
            if runtime.state is self._configured_to:
                reach(runtime, runtime.assignment.state)
        runtime.work()
        self._settle()
        if step.round == 0:
            runtime.reporter.beat_if_due()
            runtime.fire()
            self._settle()
        return error or runtime.fetching.take_error()

    def _wait_for(self, step: Step) -> str:
        """Wait until the inputs have come as far as the step states."""
        inbox, inbound = self._runtime.inbox, self._runtime.inbound
        for item in inbox.take_lazy():
            self._runtime.take(item)
        if inbound.holds(step.frontier):
            return ""
        within, ask_at = Patience(INPUTS_TIMEOUT), time.monotonic() + ASK_TIMEOUT
        inbox.eager = True
        try:
            while not inbound.holds(step.frontier):
                if self._runtime.state is State.FINALIZED:
                    return ""  # it reads nothing any more
                behind = inbound.reaches(step.frontier)  # by a marker, which comes behind what was put before it
                hopeless = (behind or time.monotonic() > ask_at) and not inbound.ask_for_missing(step.frontier)
                if hopeless or within.is_over():
                    return "" if behind else f"{NOT_COME}: {inbound.missing(step.frontier)}"
                self._pump_once()
            return ""
        finally:
            inbox.eager = False

    def _settle(self) -> None:
        """Finish all that was begun: heavy work takes wall-clock time, but no simulated time."""
        self._runtime.work()
        while self._runtime.compute.under_way:
            self._pump_and_work()

    def _acknowledge(self, step: Step, touched: tuple[str, ...], error: str) -> None:
        runtime = self._runtime
        published = dict(runtime.writers.advanced)
        runtime.writers.advanced.clear()
        ack = Ack(
            self._name,
            self._incarnation,
            step.number,
            published,
            self._next_wake(),
            runtime.slots.wanted,
            self._wiring.news(),
            touched,
            error,
            self._news.take(runtime.reporter.status),
            runtime.holds_time,
            runtime.writers.newest(key for key in self._source_reads if key in published),
        )
        self._last_ack = ack
        self._answer(ack)

    def _answer(self, ack: Ack) -> None:
        try:
            self._send(ack)
        except BadMessage as error:  # together, news may be larger than a message may be
            self._runtime.reporter.fault("news of this component", error)
            self._last_ack = replace(ack, news=None)
            self._send(self._last_ack)

    def _send(self, ack: Ack) -> None:
        if not self._link.send(ack):
            self._publisher.put(self._keys.clock("ack"), ack)

    def _pump_and_work(self) -> None:
        """Take what arrives, and do what each result of heavy work leads to before the next one is taken.

        How many results have come by now depends on the machine.
        """
        self._pump_once(self._runtime.work)

    def _pump_once(self, then: Callable[[], object] = lambda: None) -> None:
        """Take what arrives, answer control queries, keep the heartbeat; ``then`` is called after each item."""
        runtime = self._runtime
        runtime.answering.answer_parked()
        wait = min(runtime.reporter.beat_if_due(), JOIN_INTERVAL)
        parked = runtime.answering.seconds_to_next()
        item = runtime.inbox.get(wait if parked is None else min(wait, parked))
        while item is not None:
            runtime.take(item)
            then()
            item = None if self._step is not None else runtime.inbox.get(0.0)
