"""The client: one object through which a tool sees a running system and asks things of it."""

from __future__ import annotations

import os
import secrets
from collections.abc import Callable
from typing import TypeVar

from regraft.bus.interface import Bus, Closable, Sample
from regraft.bus.known_runs import living_runs
from regraft.bus.zenoh_bus import open_bus
from regraft.bus_schema.annotations import PlainValue
from regraft.bus_schema.encoding import codec
from regraft.bus_schema.errors import BadMessage
from regraft.bus_schema.keys import CONTROL_VERBS, Keys, component_name, topic_name
from regraft.bus_schema.messages.health import ComponentStatus, Event
from regraft.bus_schema.messages.management.manager import ArchitectureRequest
from regraft.bus_schema.messages.management.qualities import MeasuredQualities
from regraft.bus_schema.messages.protocol.clock import ClockTime
from regraft.bus_schema.messages.protocol.control import (
    AskQualities,
    AskTypes,
    ComponentView,
    ControlError,
    KnownTypes,
    ParameterValues,
    Qualities,
    Rewire,
    SetTransition,
    Snapshot,
    StateRequest,
    StateStep,
    TypeDescription,
)
from regraft.bus_schema.messages.protocol.host import (
    DescribeComponent,
    HostStatus,
    HostView,
    LogLines,
    LogRequest,
    StartComponent,
    StopComponent,
)
from regraft.bus_schema.messages.protocol.usage import HostUsage
from regraft.bus_schema.messages.quality import Quality
from regraft.bus_schema.model.adaptation import ADAPT, ARCHITECTURE, AdaptationReport, AdaptationRequest, Change
from regraft.bus_schema.model.architecture import Architecture
from regraft.bus_schema.model.description import Description
from regraft.bus_schema.suggestions import instead_of
from regraft.client.errors import ClientError, ControlRefused, NoAnswer, NoSuchComponent, NoSuchHost
from regraft.client.listener import Listener
from regraft.client.requests import ClientGoal, Requests, never
from regraft.client.seen import Board, ComponentSeen, HostSeen
from regraft.client.sending import Sender
from regraft.client.topics import Subscription, TopicSample
from regraft.patience import stretched
from regraft.request_protocol import reader
from regraft.run_directory import RunInfo

A = TypeVar("A")
F = TypeVar("F")

PRESENCE_TIMEOUT = 1.0
"""Seconds that asking who is alive may take; these, and what a component or host is asked, more where it is crowded."""
CHANGING = SetTransition | ParameterValues | Rewire | StateRequest
ControlMessage = CHANGING | AskQualities | AskTypes
ControlReply = ComponentView | Description | Qualities | Snapshot | KnownTypes | MeasuredQualities
HostMessage = StartComponent | StopComponent | LogRequest | DescribeComponent


class Client:
    """Sees and asks a running system from outside simulated time. Thread-safe; every wait is bounded.

    Callbacks run one at a time on the client's own thread; from within one, nothing that waits may be called.
    Close the client, best by ``with``: an open session keeps the process alive.
    """

    def __init__(
        self,
        bus: Bus,
        system: str,
        name: str | None = None,
        *,
        owns_bus: bool = False,
        has_ended: Callable[[], bool] = never,
    ) -> None:
        """Listen to ``system`` on ``bus``, which is closed with the client if it ``owns_bus``.

        ``name`` must be unique in the system. Callers that wait get CallFailed once the system ``has_ended``. That is
        called on the client's thread while an answer is late.
        """
        self.name = name or f"cli-{os.getpid()}-{secrets.token_hex(4)}"
        self.system = system
        self.keys = Keys(system)
        self._bus = bus
        self._owns_bus = owns_bus
        self._sender = Sender(bus, self.name)
        self._requests = Requests(self.keys, self.name, self._sender, has_ended)
        self._board = Board()
        self._listener = Listener(bus, self.name, self._requests.ask_again)
        self._listener.subscribe(self.keys.reply("**", self.name), self._requests.deliver)
        self._hear(self.keys.status("*"), ComponentStatus, self._board.take_component)
        self._hear(self.keys.host("*", "status"), HostStatus, self._board.take_host)
        self._hear(self.keys.clock("time"), ClockTime, self._board.take_clock)
        self._hear(self.keys.qualities("*"), MeasuredQualities, self._board.take_measured, lazy=True)

    @classmethod
    def connect(cls, info: RunInfo, name: str | None = None) -> Client:
        """Join a running system; raises BusError if it cannot be reached."""
        bus = open_bus(info.hub, lockstep=info.simulated)
        return cls(bus, info.system, name, owns_bus=True)

    def close(self) -> None:
        """Leave; callers that still wait get CallFailed. A second call does nothing."""
        self._requests.close()
        self._listener.stop()
        self._sender.close()
        if self._owns_bus:
            self._bus.close()

    def __enter__(self) -> Client:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _may_wait(self) -> None:
        if self._listener.is_here:
            raise RuntimeError("a client's callback cannot wait for the client: nobody would hear the answer")

    # --- services and actions ---

    def call(self, service: str, request: object, reply: type[A], timeout: float = 5.0, *, patient: bool = False) -> A:
        """Ask a service and return its reply.

        A ``patient`` caller that is refused for now asks again at the refusal's time, until ``timeout`` is over.

        Raises:
            CallFailed: refused or failed (``answer`` is which), or silence for ``timeout`` seconds (None).
            BadMessage: the request does not fit its type.
        """
        self._may_wait()
        return self._requests.call(service, codec.to_plain(request), reader(reply), timeout, patient=patient)

    def call_plain(self, service: str, body: PlainValue, timeout: float = 5.0) -> PlainValue:
        """Ask a service by plain data and return the plain data of its reply; raises CallFailed."""
        self._may_wait()
        return self._requests.call(service, body, _as_it_is, timeout)

    def goal(
        self,
        service: str,
        goal: object,
        result: type[A],
        feedback: type[F] | None = None,
        *,
        on_feedback: Callable[[F], object] | None = None,
        accept_within: float = 5.0,
        outlives: bool = False,
    ) -> ClientGoal[A, F]:
        """Give an action a goal; returns once it is accepted, raises CallFailed if it is not.

        It is cancelled when this client closes, or its process ends, unless it ``outlives`` it.
        """
        self._may_wait()
        read_feedback = reader(feedback) if feedback is not None else None
        return self._requests.goal(
            service, codec.to_plain(goal), reader(result), read_feedback, on_feedback, accept_within, outlives=outlives
        )

    def goal_plain(
        self,
        service: str,
        body: PlainValue,
        *,
        on_feedback: Callable[[PlainValue], object] | None = None,
        accept_within: float = 5.0,
        outlives: bool = False,
    ) -> ClientGoal[PlainValue, PlainValue]:
        """Give an action a goal by plain data; result and feedback are plain data too; raises CallFailed."""
        self._may_wait()
        return self._requests.goal(service, body, _as_it_is, _as_it_is, on_feedback, accept_within, outlives=outlives)

    def reaches(self, service: str) -> bool:
        """Return whether a subscriber gets requests to a service or action now; raises BusError."""
        return self._requests.reaches(service)

    def adapt(
        self, *changes: Change, reason: str = "", dry_run: bool = False, timeout: float = 60.0
    ) -> AdaptationReport:
        """Have the adaptation manager carry out changes, all or none; returns what became of it. Raises CallFailed."""
        request = AdaptationRequest(changes, reason, self.name, dry_run=dry_run)
        return self.call(ADAPT, request, AdaptationReport, timeout)

    def architecture(self, revision: int | None = None, timeout: float = 5.0) -> Architecture:
        """Return the architecture that the adaptation manager keeps, now or at a revision. Raises CallFailed."""
        return self.call(ARCHITECTURE, ArchitectureRequest(revision), Architecture, timeout)

    # --- components ---

    def control(
        self, component: str, verb: str, message: ControlMessage | None = None, timeout: float = 2.0
    ) -> ControlReply:
        """Ask the living run of a component a control query; without a message it only reads.

        ``describe`` gives a Description, or Qualities if these are asked for. ``state`` gives a Snapshot unless it
        restores, ``types`` gives KnownTypes, ``qualities`` MeasuredQualities. The others give a ComponentView.

        Raises:
            NoSuchComponent: no run of it is alive.
            NoAnswer: it did not answer within ``timeout`` seconds, which are more on a crowded machine.
            ControlRefused: it failed, or refused: in a stack, changes are the adaptation manager's.
        """
        if verb not in CONTROL_VERBS:
            raise ClientError(f"there is no control query {verb!r}; there are: {', '.join(CONTROL_VERBS)}")
        expected: type[ControlReply] = ComponentView
        if verb == "describe":
            expected = Qualities if isinstance(message, AskQualities) else Description
        elif verb == "state" and (not isinstance(message, StateRequest) or message.step is StateStep.SNAPSHOT):
            expected = Snapshot
        elif verb == "types":
            expected = KnownTypes
        elif verb == "qualities":
            expected = MeasuredQualities
        return self._control(component, verb, message, expected, timeout)

    def _control(self, component: str, verb: str, message: object | None, reply: type[A], timeout: float) -> A:
        who, asked = f"component {component!r}", self._living_run(component)
        try:
            return self._query(who, self.keys.control(component, asked, verb), message, reply, timeout)
        except NoAnswer:
            # It may have been succeeded meanwhile; what changes something is not asked of two runs.
            living = self._runs_alive(component).get(component)
            if living in (None, asked) or isinstance(message, CHANGING):
                raise
            return self._query(who, self.keys.control(component, living, verb), message, reply, timeout)

    def describe(self, component: str, timeout: float = 2.0) -> Description:
        """Return a component's description of itself; raises as ``control`` does."""
        return self._control(component, "describe", None, Description, timeout)

    def qualities(self, component: str, asked: AskQualities | None = None, timeout: float = 2.0) -> Qualities:
        """Return what quality a component gives and, as ``asked``, would give; raises as ``control`` does."""
        return self._control(component, "describe", asked or AskQualities(), Qualities, timeout)

    def ask_measured(self, component: str, timeout: float = 2.0) -> MeasuredQualities:
        """Return the qualities that a component has measured last; raises as ``control`` does."""
        return self._control(component, "qualities", None, MeasuredQualities, timeout)

    def last_measured(self, component: str) -> MeasuredQualities | None:
        """Return the qualities that a component has published last while this client listened, None if none."""
        self._listener.take_lazy()
        return self._board.measured(component)

    def types(self, component: str, *names: str, timeout: float = 2.0) -> tuple[TypeDescription, ...]:
        """Return message types as a component describes them, those of ``names`` that it knows.

        Without names, these are the types of its ports, services and actions. Raises as ``control`` does; a component
        that does not know the query refuses it.
        """
        return self._control(component, "types", AskTypes(names), KnownTypes, timeout).types

    def view(self, component: str, timeout: float = 2.0) -> ComponentView:
        """Return a component's state, parameters and connections now; raises as ``control`` does."""
        return self._control(component, "connections", None, ComponentView, timeout)

    def components(self, wait: float = 2.0) -> dict[str, ComponentSeen]:
        """Return all components by name, waiting at most ``wait`` seconds until each has published its status."""
        self._may_wait()
        alive, hosts = self._alive_components(), self._alive_hosts()
        self._board.wait_until_heard(alive, hosts, wait)
        return self._board.components(alive)

    def _living_run(self, component: str) -> int:
        runs = self._runs_alive(component_name(component))
        if component not in runs:
            hint = instead_of(component, self._alive_components())
            raise NoSuchComponent(f"no component {component!r} is alive; {hint}")
        return runs[component]

    def _alive_components(self) -> dict[str, int]:
        return self._runs_alive("*")

    def _runs_alive(self, component: str) -> dict[str, int]:
        within = stretched(PRESENCE_TIMEOUT)
        tokens = self._bus.present(self.keys.alive(component, "*"), within)
        return living_runs(self._bus, self.keys, tokens, within)

    # --- hosts ---

    def hosts(self, wait: float = 2.0) -> dict[str, HostSeen]:
        """Return all hosts by name, waiting at most ``wait`` seconds until each has published its status."""
        self._may_wait()
        alive = self._alive_hosts()
        self._board.wait_until_heard({}, alive, wait)
        return self._board.hosts(alive)

    def host_view(self, host: str, timeout: float = 2.0) -> HostView:
        """Return what a host was given; raises as ``ask_host`` does."""
        return self.ask_host(host, "view", None, HostView, timeout)

    def usage(self, host: str, timeout: float = 2.0) -> HostUsage:
        """Return what the components of a host take; raises as ``ask_host`` does."""
        return self.ask_host(host, "usage", None, HostUsage, timeout)

    def ask_host(self, host: str, verb: str, message: HostMessage | None, reply: type[A], timeout: float = 2.0) -> A:
        """Ask a host: ``start`` and ``stop`` give a HostStatus, ``logs`` LogLines, ``view`` a HostView, ``usage``
        a HostUsage, ``describe`` a DescribedComponent.

        Raises:
            NoSuchHost: it is not there.
            NoAnswer, ControlRefused: it stays silent for ``timeout`` seconds, or refuses.
        """
        alive = self._alive_hosts()
        if host not in alive:
            raise NoSuchHost(f"no host {host!r} is alive; {instead_of(host, alive)}")
        return self._query(f"host {host!r}", self.keys.host(host, verb), message, reply, timeout)

    def logs(self, component: str, lines: int = 100, timeout: float = 2.0) -> tuple[str, ...]:
        """Return the last lines of a component's log, oldest first.

        Raises:
            NoSuchHost: no host runs it.
            NoAnswer, ControlRefused: its host stays silent, or refuses.
        """
        seen = self.components(timeout).get(component_name(component))
        if seen is not None and seen.host is None:  # it has just begun, and its host has not reported it yet
            self._board.wait_for_host_of(component, stretched(timeout))
            seen = self.components(timeout).get(component)
        if seen is None or seen.host is None:
            raise NoSuchHost(f"no host runs a component {component!r}, so none keeps its log")
        request = LogRequest(component, lines)
        return self.ask_host(seen.host, "logs", request, LogLines, timeout).lines

    def _alive_hosts(self) -> set[str]:
        tokens = self._bus.present(self.keys.host("*", "alive"), stretched(PRESENCE_TIMEOUT))
        return {token.split("/")[-2] for token in tokens}

    # --- looking on ---

    def clock(self, wait: float = 0.0) -> ClockTime | None:
        """Return simulated time as last published; None under the real clock, and if none comes in ``wait`` seconds."""
        return self._board.clock(wait)

    def events(self, callback: Callable[[Event], object]) -> Closable:
        """Have ``callback`` called with all that happens, until the returned subscription is closed."""
        return self._hear(self.keys.event, Event, callback)

    def requirements(self, callback: Callable[[Quality], object]) -> Closable:
        """Have ``callback`` called with how well the mission's requirements are met, whenever that changes."""
        return self._hear(self.keys.quality("*"), Quality, callback)

    def measurements(self, component: str, callback: Callable[[TopicSample], object]) -> Subscription:
        """Have ``callback`` called with the MeasuredQualities that a component publishes."""
        return self._subscribe(component, self.keys.qualities(component_name(component)), MeasuredQualities, callback)

    def _hear(self, key: str, cls: type[A], callback: Callable[[A], object], *, lazy: bool = False) -> Closable:
        def take(sample: Sample) -> None:
            try:
                message = codec.decode(sample.payload, cls)
            except BadMessage:
                return
            callback(message)

        return self._listener.subscribe(key, take, lazy=lazy)

    def topic(self, topic: str, cls: type | None, callback: Callable[[TopicSample], object]) -> Subscription:
        """Have ``callback`` called with what is published: instances of ``cls``, or plain data for None.

        A callback that cannot keep up makes the subscription drop samples, and count them.
        """
        return self._subscribe(topic, self.keys.topic(topic_name(topic)), cls, callback)

    def _subscribe(
        self, name: str, key: str, cls: type | None, callback: Callable[[TopicSample], object]
    ) -> Subscription:
        subscription = Subscription(name, cls, callback)
        subscription.begin(self._listener.subscribe(key, subscription.take, subscription.admit, subscription.miss))
        return subscription

    # --- queries ---

    def _query(self, who: str, key: str, message: object | None, reply: type[A], timeout: float) -> A:
        self._may_wait()
        payload = codec.encode(message) if message is not None else b""
        within = stretched(timeout)
        answers = self._bus.query(key, payload, within)
        if not answers:
            raise NoAnswer(f"{who} did not answer within {within:.3g} s")
        try:
            if answers[0].error:
                raise ControlRefused(who, codec.decode(answers[0].payload, ControlError))
            return codec.decode(answers[0].payload, reply)
        except BadMessage as error:
            raise ClientError(f"{who} sent an answer that does not fit: {error}") from None


def _as_it_is(plain: PlainValue) -> PlainValue:
    return plain
