"""The parts of a running component, which its lifecycle, its control and its hand-over use."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Coroutine, Iterable
from functools import partial
from typing import Any

from regraft.bus.inbox import Inbox
from regraft.bus.interface import Bus, Sample
from regraft.bus.socket_inbox import SocketInbox
from regraft.bus_schema.errors import BadMessage
from regraft.bus_schema.keys import Keys
from regraft.bus_schema.messages.protocol.refusal_codes import RefusalCode
from regraft.bus_schema.model.lifecycle import State
from regraft.bus_schema.model.robots.scopes import service_in_scope
from regraft.component.component import Component, declared_for, parameter_set
from regraft.component.errors import RequestRefused
from regraft.component.future import Cancelled
from regraft.runtime.core.assignment import Assignment
from regraft.runtime.core.clock import Clock
from regraft.runtime.core.compute import Compute
from regraft.runtime.core.exclusive import Slots
from regraft.runtime.core.overlap import Overlap
from regraft.runtime.core.tasks import RunningTask, Tasks
from regraft.runtime.core.timers import Timers
from regraft.runtime.data.fetching import Fetching
from regraft.runtime.data.inbound import Consumer, Inbound
from regraft.runtime.data.inputs import LiveInput, NewestInput, TopicReader
from regraft.runtime.data.outputs import LiveOutput
from regraft.runtime.data.repair import Repair
from regraft.runtime.data.run_check import RunCheck
from regraft.runtime.data.status_reporter import StatusReporter
from regraft.runtime.data.stream import Stream
from regraft.runtime.data.writers import Identity, Writers
from regraft.runtime.presence import Presence
from regraft.runtime.requests.request_client import RequestClient
from regraft.runtime.requests.request_server import Server


class Parts:
    """The parts of a running component. Everything here happens on one thread.

    Attributes:
        direct: what takes the samples of some keys at once, by key.
        socket_inbox: the inbox, if it waits for sockets too.
        marker_listeners: called with key, source and stream of every marker.
        tick: the world tick that this component is in, None in real time.
        failing: why the component wants to fail, empty if it does not; ``fail`` then does it between two handlers.
        around: returns what is called instead of a periodic call.
    """

    def __init__(self, cls: type[Component], assignment: Assignment, bus: Bus, clock: Clock) -> None:
        """Build the parts and the component, whose ``__init__`` is still to be called.

        Raises:
            ParameterError: the assignment's parameters do not fit the class.
            BadMessage: it is to take over from another run, and is a source of time.
        """
        self.assignment = assignment
        self.bus = bus
        self.clock = clock
        self.keys = Keys(assignment.system)
        self.stepped = assignment.simulated and cls.lockstep
        if cls.is_time_source and assignment.succeeds is not None:
            raise BadMessage("succeeds: a source of simulated time cannot take over from another run")
        self.parameters = parameter_set(cls, assignment.parameters)
        self.declared = declared_for(cls, self.parameters)
        self.identity = Identity(assignment.name, assignment.incarnation, assignment.incarnation)
        self.socket_inbox = SocketInbox() if self.stepped and assignment.step_socket else None
        self.inbox = self.socket_inbox or Inbox()
        self.take_in: Callable[[Any], object] = self.inbox.put
        self.direct: dict[str, Callable[[Sample], None]] = {}
        self.marker_listeners: list[Callable[[str, str, Stream], None]] = []
        self.tick: int | None = None
        self.holds_time = False
        self.failing = ""
        self._newest: list[NewestInput[Any]] = []
        self.fail: Callable[[], None] = lambda: None
        self.checkpoint: Callable[[], None] = lambda: None
        self.around: Callable[[Callable[[], object]], Callable[[], object]] = lambda call: call
        self.tasks = Tasks()
        self.timers = Timers()
        self.slots = Slots(stepped=self.stepped)
        self.compute = Compute(self.post)
        self.reporter = StatusReporter(bus, self.keys, clock, self.identity, assignment.heartbeat)
        self.repair = Repair(bus, self.keys, assignment.name, self.post)
        self.inbound = self._inbound()
        self.fetching = Fetching(bus, self.keys, self.inbox, self.reporter.beat_if_due)
        self.writers = Writers(bus, clock, self.identity, self.reporter.fault)
        self.writers.keeps_history, self.writers.lockstep = True, self.stepped
        client = f"{assignment.name}-{assignment.incarnation}"
        self.requests = RequestClient(self.keys, client, self.writers, self.timers, self.reporter, assignment.scope)
        self.component = cls.__new__(cls)
        self.inputs = {name: self._input(name) for name in self.declared.inputs}
        self.outputs = {
            name: LiveOutput(output, self.writers, self.reporter) for name, output in self.declared.outputs.items()
        }
        self.servers = [self._server(name) for name in self.declared.services]
        self.presence = Presence(
            lambda: self.assignment,
            bus,
            self.inbox,
            self.inbound,
            self.requests,
            self.servers,
            self.reporter,
            stepped=self.stepped,
        )

    def _inbound(self) -> Inbound:
        check = RunCheck(self.bus, self.keys, self.assignment.name, self.post)
        inbound = Inbound(self.clock, stepped=self.stepped, on_marker=self._marker, repair=self.repair, check=check)
        self.repair.arrive, self.repair.strike = inbound.arrive, inbound.strike
        check.disbelieve = inbound.disbelieve
        return inbound

    def _input(self, name: str) -> LiveInput[Any]:
        port = self.declared.inputs[name]
        method = getattr(self.component, port.handler_name) if port.handler_name else None
        if port.on_demand:
            return LiveInput(port, None, self.reporter, self.fetching if self.stepped else None)
        if method is not None and port.handler_takes_name:
            method = partial(method, name)
        if method is not None and inspect.iscoroutinefunction(method):
            left_out = partial(self.reporter.overrun, f"input {name!r}", messages=1)
            method = self.overlapping(name, method, left_out, answers=True)
        if method is not None and port.latest_only and not self.stepped:
            self._newest.append(NewestInput(port, method, self.reporter, self.inbox))
            return self._newest[-1]
        return LiveInput(port, method, self.reporter)

    def _server(self, name: str) -> Server:
        offered = self.declared.services[name]
        return Server(
            offered,
            self.assignment.services.get(name, service_in_scope(self.assignment.name, self.assignment.scope, name)),
            getattr(self.component, offered.method),
            self.keys,
            self.writers,
            self.tasks,
            self.reporter,
            self._refusal,
        )

    def _refusal(self) -> RequestRefused | None:
        if self.state is State.ACTIVE:
            return None
        why = f"{self.assignment.name} is {self.state.value}, it serves only while active"
        return RequestRefused(why, RefusalCode.NOT_ACTIVE)

    def _marker(self, key: str, source: str, stream: Stream) -> None:
        for listener in self.marker_listeners:
            listener(key, source, stream)

    @property
    def state(self) -> State:
        """The lifecycle state."""
        return self.reporter.status.state

    @property
    def handler_timeout(self) -> float:
        """The seconds for which a handler or hook may keep the loop."""
        assigned = self.assignment.handler_timeout
        return type(self.component).handler_timeout if assigned is None else assigned

    def is_reliable(self, key: str) -> bool:
        """Return whether the topic at ``key`` is reliable, rather than a sensor stream."""
        return self.keys.topic_of(key) not in self.assignment.sensor_streams

    def reader(self, key: str) -> TopicReader | None:
        """Return the inputs that read ``key``."""
        consumer = self.inbound.consumers.get(key)
        return consumer if isinstance(consumer, TopicReader) else None

    # --- work ---

    def post(self, call: Callable[[], object]) -> None:
        """Call something on the component's thread. Any thread may use this."""
        self.inbox.put(call)

    @property
    def has_work(self) -> bool:
        """Whether a sample or a task is ready."""
        return bool(self.inbound.ready or self.tasks.in_line)

    def work(self) -> None:
        """Handle all that is ready: samples in their order, then tasks, until nothing is left.

        Tasks come first while a handler is full: most of its calls may only be in line.
        """
        tasks, ready, in_line = self.tasks, self.inbound.ready, self.tasks.in_line
        self.fail_if_wanted()
        while ready or in_line:
            try:
                if ready and not (tasks.full and in_line):
                    consumer, sample = ready.popleft()
                    consumer.deliver(sample)
                else:
                    tasks.run()
            except Exception as error:
                self.reporter.fault("delivery", error)
            self.fail_if_wanted()
            if ready or in_line:
                self.reporter.beat_if_due()  # many messages take long, and only a handler that does not return hangs

    def handle_newest(self) -> None:
        """Handle the newest messages that are in line: a control query comes behind what came before it."""
        for port in self._newest:
            if port.handle_before_its_turn():
                self.work()

    def handle_first(self, kept: list[tuple[Consumer, Sample]]) -> None:
        """Handle what was kept for inputs before all that comes; in simulated time now, since a slot is one instant."""
        if not self.stepped:
            self.inbound.ready.extendleft(reversed(kept))
            return
        for port, sample in kept:
            port.deliver(sample)
            self.reporter.beat_if_due()

    def fail_if_wanted(self) -> None:
        """Fail now if a handler that has returned wanted to."""
        if self.failing:
            self.fail()

    def handle(self, samples: Iterable[Sample]) -> None:
        """Handle samples that were held, in their order."""
        for sample in samples:
            self.inbound.arrive(sample)
        self.work()

    def guarded(self, where: str, call: Callable[[], object]) -> None:
        """Call an author's method, and report its exceptions."""
        try:
            call()
        except Exception as error:
            self.reporter.fault(where, error)

    def overlapping(
        self,
        name: str,
        method: Callable[..., Coroutine[Any, Any, Any]],
        left_out: Callable[[], None],
        *,
        answers: bool = False,
    ) -> Callable[..., None]:
        """Return what runs an asynchronous handler or timer; its calls may overlap within bounds."""
        return Overlap(method, partial(self.spawn, name, answers=answers), left_out, self.tasks).call

    def spawn(
        self,
        name: str,
        coroutine: Coroutine[Any, Any, Any],
        ended: Callable[[], None] = lambda: None,
        *,
        answers: bool = False,
    ) -> RunningTask:
        """Run a coroutine as a task whose exceptions are reported; ``answers`` if it handles one message."""

        def done(_: Any, error: BaseException | None) -> None:
            ended()
            if error is not None and not isinstance(error, Cancelled):
                self.reporter.fault(name, error)

        return self.tasks.spawn(name, coroutine, done, answers=answers)
