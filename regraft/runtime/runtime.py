"""One component, running: its parts put together. Loops (``loop``, ``regraft.stepped``) say when it works."""

from __future__ import annotations

import inspect
import time
from collections.abc import Callable, Container, Coroutine
from concurrent.futures import Future, ThreadPoolExecutor
from typing import Any

from bus_schema.encoding.envelope import is_marker
from bus_schema.errors import BadMessage
from bus_schema.keys import Keys
from bus_schema.messages.quality import Quality
from bus_schema.messages.requests import RefusalCode
from bus_schema.model.lifecycle import State
from regraft.assignment import Assignment
from regraft.bus import Bus, Closable, Sample
from regraft.clock import Clock
from regraft.component import Component, declared, declared_for
from regraft.inbox import Inbox
from regraft.parameters import ParameterSet
from regraft.runtime.calling import Caller
from regraft.runtime.control import Control
from regraft.runtime.exclusive import Slots
from regraft.runtime.handover import HandingOver
from regraft.runtime.herald import Herald
from regraft.runtime.inbound import Inbound
from regraft.runtime.inputs import InputPort, TopicReader
from regraft.runtime.kit import Kit
from regraft.runtime.lifecycle import Lifecycle
from regraft.runtime.outputs import OutputPort
from regraft.runtime.repair import Repair
from regraft.runtime.rewiring import Rewiring
from regraft.runtime.run_check import RunCheck
from regraft.runtime.serving import RequestRefused, Server
from regraft.runtime.stream import Stream
from regraft.runtime.tasks import Cancelled, Task, Tasks, Waiting
from regraft.runtime.timers import Timers
from regraft.runtime.writers import Identity, Writers

MARK_PAUSES = (0.05, 0.2, 0.75)
"""Seconds between the markers that are put on a new link."""


class Runtime:
    """The one place that knows all parts of a running component. Everything here happens on one thread."""

    def __init__(self, cls: type[Component], assignment: Assignment, bus: Bus, clock: Clock) -> None:
        """Build the component and what it is told; nothing is declared on the bus yet.

        Raises:
            ParameterError: the assignment's parameters do not fit the class.
            BadMessage: it is to take over from another run, and makes simulated time go on.
        """
        self.assignment = assignment
        self.bus = bus
        self.clock = clock
        self.keys = Keys(assignment.system)
        self.stepped = assignment.simulated and cls.in_step
        if cls.makes_time and assignment.succeeds is not None:
            raise BadMessage("succeeds: a source of simulated time cannot take over from another run")
        of_class = declared(cls)
        self.parameters = ParameterSet(of_class.parameters)
        self.parameters.set(assignment.parameters, starting=True)
        self.declared = declared_for(cls, self.parameters.values)
        epoch = assignment.incarnation
        self.identity = Identity(assignment.name, epoch, assignment.incarnation)
        self.inbox = Inbox()
        self.take_in: Callable[[Any], object] = self.inbox.put
        self.direct: dict[str, Callable[[Sample], None]] = {}
        self.marker_listeners: list[Callable[[str, str, Stream], None]] = []
        self.herald = Herald(bus, self.keys, clock, self.identity, assignment.heartbeat)
        self.repair = Repair(bus, self.keys, assignment.name, self.post)
        check = RunCheck(bus, self.keys, assignment.name, self.post)
        self.inbound = Inbound(clock, stepped=self.stepped, on_marker=self._marker, repair=self.repair, check=check)
        self.repair.arrive, self.repair.strike = self.inbound.arrive, self.inbound.strike
        check.disbelieve = self.inbound.disbelieve
        self.writers = Writers(bus, clock, self.identity, self.herald.fault)
        self.writers.keeps_history, self.writers.in_step = True, self.stepped
        bus.when_renewed(lambda: self.post(self._link_renewed))
        self.tasks = Tasks()
        self.timers = Timers()
        self.slots = Slots(stepped=self.stepped)
        self.computing = 0
        self.tick: int | None = None
        self.requirements: dict[str, Quality] = {}
        self.caller = Caller(self.keys, f"{assignment.name}-{epoch}", self.writers, self.timers, self.herald)
        self.component = cls.__new__(cls)
        self.component.kit = Kit(self)
        self.inputs = {name: self._input(name) for name in self.declared.inputs}
        self.outputs = {
            name: OutputPort(output, self.writers, self.herald) for name, output in self.declared.outputs.items()
        }
        # Where the class has the declarations, the instance has the live ports.
        vars(self.component).update({name: self.inputs[name] for name in of_class.inputs})
        vars(self.component).update({name: self.outputs[name] for name in of_class.outputs})
        self.servers = [self._server(name) for name in self.declared.services]
        self.rewiring = Rewiring(self)
        self.handover = HandingOver(self)
        self.lifecycle = Lifecycle(self)
        self.control = Control(self)
        self._executor: ThreadPoolExecutor | None = None
        self._always: list[Closable] = []
        self._token: Closable | None = None
        self._seen_as: int | None = None
        self.component.__init__()  # type: ignore[misc]

    @property
    def handler_timeout(self) -> float:
        """The seconds for which a handler or hook may keep the loop."""
        assigned = self.assignment.handler_timeout
        return type(self.component).longest_handler if assigned is None else assigned

    def _input(self, name: str) -> InputPort[Any]:
        port = self.declared.inputs[name]
        method = getattr(self.component, port.handler_name) if port.handler_name else None
        if method is not None and inspect.iscoroutinefunction(method):
            return InputPort(port, lambda message: self.spawn(name, method(message), answers=True), self.herald)
        return InputPort(port, method, self.herald)

    def _server(self, name: str) -> Server:
        offered = self.declared.services[name]
        return Server(
            offered,
            self.assignment.services.get(name, name),
            getattr(self.component, offered.method),
            self.keys,
            self.writers,
            self.tasks,
            self.herald,
            self._refusal,
        )

    def _refusal(self) -> RequestRefused | None:
        if self.state is State.ACTIVE:
            return None
        why = f"{self.assignment.name} is {self.state.value}, it serves only while active"
        return RequestRefused(why, RefusalCode.NOT_ACTIVE)

    def end_goals_of(self, members: tuple[str, ...]) -> None:
        """End the goals of members whose run has ended, and of clients outside of the clock that listen no longer."""
        for server in self.servers:
            server.end_goals_of(members)
        self.end_goals_of_nobody(self.inbound.from_outside)

    def end_goals_of_nobody(self, among: Container[str] | None = None) -> None:
        """End the goals whose clients listen to their replies no longer, of all or ``among`` some."""
        for server in self.servers:
            if server.goals:
                server.end_goals_of_nobody(time.monotonic(), among)

    @property
    def state(self) -> State:
        """The lifecycle state."""
        return self.herald.status.state

    # --- start and end ---

    def declare(self) -> None:
        """Appear on the bus: control queries, replies, services, the token, the first status."""
        self.listen_for_control()
        self.listen_for_replies()
        self.listen_for_requests()
        self.herald.say(revision=self.assignment.revision)
        self.appear()

    def listen_for_control(self) -> None:
        """Answer the control queries of this incarnation."""
        key = self.keys.control(self.assignment.name, self.assignment.incarnation, "*")
        self._always.append(self.bus.serve(key, self.inbox.put))

    def listen_for_replies(self) -> None:
        """Read the replies to what this component asks, under the name by which it asks now."""
        replies = self.keys.reply("**", self.caller.client)
        self.inbound.add(replies, self.caller)
        self._always.append(self.bus.subscribe(replies, self.inbox.put))

    def listen_for_requests(self) -> None:
        """Read the requests to this component's services."""
        for server in self.servers:
            key = self.keys.request(server.name)
            self.inbound.add(key, server)
            self._always.append(self.bus.subscribe(key, self.inbox.put))

    def appear(self) -> None:
        """Have the liveliness token of this incarnation seen, and no other's."""
        run = self.assignment.incarnation
        if run == self._seen_as:
            return
        former = self._token
        self._token, self._seen_as = self.bus.announce(self.keys.alive(self.assignment.name, run)), run
        if former is not None:
            former.close()

    def leave(self) -> None:
        """Disappear from the bus, whatever state this is in."""
        self.handover.leave()
        if self._token is not None:
            self._token.close()
        for closable in reversed(self._always):
            closable.close()
        self._always.clear()
        self.lifecycle.disconnect()
        self.writers.close_all()
        self.herald.close()
        self.inbox.close()
        if self._executor:
            self._executor.shutdown(wait=False, cancel_futures=True)

    def tell_quality(self, quality: Quality) -> None:
        """Put how a quality requirement is met, and answer whoever asks for it from now on."""
        key = self.keys.quality(quality.requirement)
        if key not in self.requirements:
            self._always.append(self.bus.serve(key, self.inbox.put))
        self.requirements[key] = quality
        self.herald.quality(quality)

    # --- work ---

    def take(self, item: Any) -> None:
        """Take one item from the inbox: a sample, a query, or something to be called on this thread."""
        sample = self.bus.open_sample(item)
        if sample is not None:
            if self.direct and sample.key in self.direct:
                self.direct[sample.key](sample)
            else:
                self.inbound.arrive(sample)
            return
        query = self.bus.open_query(item)
        if query is not None:
            self.control.take(query)
        elif callable(item):
            item()

    def take_unless_data(self, item: Any) -> None:
        """Take one item from the inbox, but drop a topic's message: markers, requests and queries still count."""
        sample = self.bus.open_sample(item)
        if sample is None or self.keys.topic_of(sample.key) is None or is_marker(sample.attachment):
            self.take(item)

    def post(self, call: Callable[[], object]) -> None:
        """Have something called on the component's thread; may be called from any thread."""
        self.inbox.put(call)

    def work(self) -> None:
        """Handle all that is ready: samples in their order, then tasks, until nothing is left."""
        ready, in_line = self.inbound.ready, self.tasks.in_line
        while ready or in_line:
            try:
                if ready:
                    consumer, sample = ready.popleft()
                    consumer.deliver(sample)
                else:
                    self.tasks.run()
            except Exception as error:
                self.herald.fault("delivery", error)
            if ready or in_line:
                self.herald.beat_if_due()  # many messages take long, and only a handler that does not return hangs

    @property
    def has_work(self) -> bool:
        """Whether a sample or a task is ready."""
        return bool(self.inbound.ready or self.tasks.in_line)

    def fire(self) -> None:
        """Call the timers that are due, in order of declaration, then wake the sleepers that are due."""
        now = self.clock.now()
        for timer in self.timers.take_due(now):
            self.guarded(timer.name, timer.call)
            self.work()
        self.timers.wake_sleepers(now)
        self.work()

    def start_timers(self) -> None:
        """Start the ``@every`` methods."""
        now = self.clock.now()
        for name, period in self.declared.timers.items():
            method = getattr(self.component, name)
            call = (lambda n=name, m=method: self.spawn(n, m())) if inspect.iscoroutinefunction(method) else method
            self.timers.start(name, call, period.nanoseconds(self.parameters.values), now)
        every = type(self.component).checkpoint_every
        if every is not None:
            self.timers.start("checkpoint", self.control.checkpoint, max(1, round(every * 1e9)), now)

    def retime(self) -> None:
        """Give timers whose period is a parameter their new period."""
        for name, period in self.declared.timers.items():
            self.timers.retime(name, period.nanoseconds(self.parameters.values), self.clock.now())

    def guarded(self, where: str, call: Callable[[], object]) -> None:
        """Call an author's method; its exceptions are reported, never fatal."""
        try:
            call()
        except Exception as error:
            self.herald.fault(where, error)

    def spawn(self, name: str, coroutine: Coroutine[Any, Any, Any], *, answers: bool = False) -> Task:
        """Run a coroutine as a task whose exceptions are reported; ``answers`` if it handles one message."""

        def done(_: Any, error: BaseException | None) -> None:
            if error is not None and not isinstance(error, Cancelled):
                self.herald.fault(name, error)

        return self.tasks.spawn(name, coroutine, done, answers=answers)

    @property
    def executor(self) -> ThreadPoolExecutor:
        """Where heavy work is done: one thread, so that results come in the order of their asking."""
        if self._executor is None:
            self._executor = ThreadPoolExecutor(1, thread_name_prefix="compute")
        return self._executor

    def computed(self, waiting: Waiting[Any], future: Future[Any]) -> None:
        """Take the result of heavy work."""
        self.computing -= 1
        error = future.exception()
        if error is not None:
            waiting.fail(error)
        else:
            waiting.resolve(future.result())

    def _link_renewed(self) -> None:
        """Make good what the broken link has lost: say how far all that is written has come, ask for what is read.

        In step there is no need: everybody is told how far to read.
        """
        if self.stepped:
            return
        self.spawn("marking", self._mark_for_a_while())
        self.repair.catch_up(self.inbound.reliable_streams())

    async def _mark_for_a_while(self) -> None:
        """Put markers more than once: until readers are known on the new link, what is put reaches nobody."""
        for pause in MARK_PAUSES:
            self.writers.mark_all()
            await self.component.kit.sleep(pause)
        self.writers.mark_all()

    def _marker(self, key: str, source: str, stream: Stream) -> None:
        self.rewiring.saw_marker(key, source, stream)
        for listener in self.marker_listeners:
            listener(key, source, stream)

    # --- what is read and written, for the simulated clock ---

    def is_reliable(self, key: str) -> bool:
        """Tell whether the topic at ``key`` is reliable, rather than a sensor stream."""
        return self.keys.topic_of(key) not in self.assignment.sensor_streams

    def reader(self, key: str) -> TopicReader | None:
        """Return the inputs that read ``key``."""
        consumer = self.inbound.consumers.get(key)
        return consumer if isinstance(consumer, TopicReader) else None
