"""The manager's requests to hosts: what they were given, which processes run, and to take over new specs."""

from __future__ import annotations

import contextlib
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, TypeVar

from regraft import Future
from regraft.adaptation_manager.targets.component_client import BESIDE, ControlFailed, NoAnswer, refusal
from regraft.bus.interface import Answer, BusError
from regraft.bus_schema.encoding import codec
from regraft.bus_schema.errors import BadMessage
from regraft.bus_schema.keys import Keys
from regraft.bus_schema.messages.protocol.host import (
    DescribeComponent,
    DescribedComponent,
    EstimatedQualities,
    EstimateQualities,
    HostStatus,
    HostView,
    JournalEnd,
    LetSpeak,
    LogLines,
    LogRequest,
    OtherHost,
    ProcessState,
    ProcessStatus,
    StartComponent,
    StartSuccessor,
    StopComponent,
    UpdateSpecs,
)
from regraft.bus_schema.model.adaptation import UnreachedCode
from regraft.bus_schema.model.architecture import Architecture, ComponentSpec
from regraft.bus_schema.model.hosts.host_state import HostState
from regraft.bus_schema.model.hosts.offers import with_offers
from regraft.patience import Patience, stretched

if TYPE_CHECKING:
    from regraft import Kit

M = TypeVar("M", HostStatus, HostView, DescribedComponent, EstimatedQualities, LogLines)

FIRST = "local"
"""The host that the others joined; it knows the specs of all components, and gives them to hosts that join."""
DESCRIBED_TIMEOUT = 25.0
"""Seconds that a host may take to describe a component: more than it gives the process that imports the class."""

JUST_JOINED = 2.0
ASK_AGAIN_INTERVAL = 0.02
"""Seconds for which a host that is there is asked again when nobody answers, and between two questions."""


@dataclass(frozen=True, slots=True)
class Update:
    """New specs under way to hosts: all are asked even if one fails, so that a restoration reaches whom it can."""

    waiting: dict[str, Future[list[Answer]]]
    learn: Callable[[HostStatus], object]
    missed: Callable[[frozenset[str]], Future[list[Answer]] | None]
    """Notifies the first host of those that did not answer: it has them join again."""
    left: frozenset[str] = frozenset()
    """The hosts that only lose components, or keep checkpoints: one that does not answer has to join again."""

    async def processes(self) -> dict[str, ProcessStatus]:
        """Return the processes that the hosts run now that they have the specs; raises ControlFailed."""
        processes, failures = await self.answers()
        for host in self.left & failures.keys():
            if isinstance(failures[host], NoAnswer):
                del failures[host]
        if failures:
            raise ControlFailed("; ".join(map(str, failures.values())), next(iter(failures.values())).code)
        return processes

    async def answers(self) -> tuple[dict[str, ProcessStatus], dict[str, ControlFailed]]:
        """Return the processes of the hosts that answered, and what went wrong with the others."""
        told: list[HostStatus] = []
        failures: dict[str, ControlFailed] = {}
        for host, waiting in self.waiting.items():
            try:
                status = _read(host, "specs", await waiting, HostStatus)
            except ControlFailed as error:
                failures[host] = error
                continue
            self.learn(status)
            told.append(status)
        silent = frozenset(host for host, error in failures.items() if isinstance(error, NoAnswer))
        notified = self.missed(silent) if silent else None
        if notified is not None:
            await notified
        return runs_of(*told), failures


def runs_of(*told: HostStatus) -> dict[str, ProcessStatus]:
    """Return hosts' processes by component, those that run next to one under its name and a plus sign.

    Where two hosts each have a run that speaks for a component, one does not know yet of its successor.
    """
    speaking: dict[str, ProcessStatus] = {}
    beside: dict[str, ProcessStatus] = {}
    for process in sorted((p for status in told for p in status.processes), key=_rank):
        former = speaking.get(process.component)
        if former is not None and former.pid:
            beside[f"{process.component}{BESIDE}"] = former
        speaking[process.component] = process
    for process in sorted((p for status in told for p in status.beside), key=_rank):
        beside[f"{process.component}{BESIDE}"] = process
    return speaking | beside


def _rank(process: ProcessStatus) -> tuple[bool, int]:
    return bool(process.pid), process.incarnation


class Hosts:
    """The hosts of one system: ``names`` are known, ``silent`` did not report which processes they run.

    ``others`` is how the first host sees the others; its every answer has it.
    """

    def __init__(self, kit: Kit, within: Callable[[], float]) -> None:
        """Know none yet; an answer may take ``within`` seconds."""
        self.names: tuple[str, ...] = ()
        self.silent: frozenset[str] = frozenset()
        self.others: dict[str, OtherHost] = {}
        self.term = 0
        self._told: dict[str, HostStatus] = {}
        self._within = within
        self._kit = kit
        self._keys = Keys(kit.system)

    def _ask(self, host: str, verb: str, payload: bytes, within: float | None = None) -> Future[list[Answer]]:
        try:
            return self._kit.ask(self._keys.host(host, verb), payload, stretched(within or self._within()))
        except BusError as error:
            raise NoAnswer(f"host {host!r}: {verb}: {error}") from None

    async def views(self) -> list[HostView]:
        """Ask every host what it was given: any first, which names the others. Raises ControlFailed."""
        first = _read("any", "view", await self._ask("*", "view", b""), HostView)
        self.names = tuple(sorted({first.host, *first.architecture.hosts}))
        asked = [(name, self._ask(name, "view", b"")) for name in self.names if name != first.host]
        views = [first]
        for name, waiting in asked:
            with contextlib.suppress(NoAnswer):
                views.append(_read(name, "view", await waiting, HostView))
        # The first host knows of all components, also of those on hosts that do not answer.
        return sorted(views, key=lambda view: view.host != FIRST)

    def _update(self, updates: dict[str, UpdateSpecs], left: frozenset[str] = frozenset()) -> Update:
        asked = {host: self._ask(host, "specs", codec.encode(updates[host])) for host in sorted(updates)}

        def missed(hosts: frozenset[str]) -> Future[list[Answer]] | None:
            given = updates.get(FIRST)
            if given is None or FIRST in hosts or not (given.specs or given.removed):
                return None
            with contextlib.suppress(NoAnswer):  # the first host is gone, and with it the system
                return self._ask(FIRST, "specs", codec.encode(replace(given, not_told=tuple(sorted(hosts)))))
            return None

        return Update(asked, self._learn, missed, left)

    def keep(self, end: JournalEnd) -> None:
        """Have the first host keep the journal's end; its answer is not waited for. Raises NoAnswer."""
        payload = codec.encode(replace(end, term=self.term))
        try:
            self._kit.bus.ask(self._keys.host(FIRST, "journal"), payload, self._within(), lambda answers: None)
        except BusError as error:
            raise NoAnswer(f"host {FIRST!r}: journal: {error}") from None

    # --- who is there ---

    def _learn(self, status: HostStatus) -> None:
        self._told[status.host] = status
        if status.host == FIRST:
            self.others = {other.host: other for other in status.others}
            self.names = tuple(sorted({*self.names, *self.others}))

    def runs(self, component: str) -> list[tuple[str, ProcessStatus]]:
        """Return the runs of a component that have not ended, each with its host, as the hosts reported last."""
        return [
            (host, process)
            for host, status in sorted(self._told.items())
            if host not in self.lost
            for process in _all_of(status)
            if process.component == component and process.state is not ProcessState.STOPPED
        ]

    def which_know(self, component: str) -> list[str]:
        """Return the hosts that reported a run of a component last, also one that has ended, and that answer."""
        return [
            host
            for host, status in sorted(self._told.items())
            if host not in self.silent and any(process.component == component for process in _all_of(status))
        ]

    def where(self, process: ProcessStatus) -> str | None:
        """Return the host that reported a process last."""
        for host, status in self._told.items():
            if any((p.component, p.started_as) == (process.component, process.started_as) for p in _all_of(status)):
                return host
        return None

    def known(self, component: str) -> dict[str, ProcessStatus]:
        """Return the runs of a component, by its name and with a plus sign, as the hosts reported last."""
        table = runs_of(*(status for host, status in self._told.items() if host not in self.lost))
        names = (component, f"{component}{BESIDE}")
        return {name: table[name] for name in names if name in table}

    def is_there(self, host: str) -> bool:
        """Return whether a host is part of the system now, as far as is known."""
        return host not in self.others or self.others[host].state is HostState.JOINED

    def why_not_there(self, host: str) -> str:
        """Return in words how it is with a host that is not there."""
        state = self.others[host].state if host in self.others else HostState.JOINED
        words = {
            HostState.ABSENT: "has not joined",
            HostState.LEFT: "has left",
            HostState.SILENT: "gives no sign of life",
            HostState.LOST: "is lost",
        }
        return f"host {host!r} {words.get(state, 'does not answer')}"

    def how_not_there(self, host: str) -> UnreachedCode:
        """Return the code of how it is with a host that is not there, or does not answer."""
        state = self.others[host].state if host in self.others else HostState.JOINED
        codes = {
            HostState.ABSENT: UnreachedCode.HOST_ABSENT,
            HostState.LEFT: UnreachedCode.HOST_LEFT,
            HostState.LOST: UnreachedCode.HOST_LOST,
        }
        return codes.get(state, UnreachedCode.HOST_SILENT)

    @property
    def lost(self) -> frozenset[str]:
        """The hosts that count as lost: what they ran may be started elsewhere."""
        gone = (HostState.LOST, HostState.LEFT)
        return frozenset(host for host, other in self.others.items() if other.state in gone)

    def absent(self) -> dict[str, str]:
        """Return the hosts that are not there, with why."""
        return {name: self.why_not_there(name) for name in self.others if not self.is_there(name)}

    async def met(self, architecture: Architecture, wanted: set[str]) -> dict[str, ProcessStatus]:
        """Ask who is there if one of the ``wanted`` hosts may have come or gone; returns the processes then known."""
        if wanted <= {FIRST} and FIRST in architecture.hosts:
            return {}
        return await self.processes(architecture.revision)

    def with_joined(self, architecture: Architecture) -> Architecture:
        """Return the architecture with the hosts that have joined without being named in it, and what hosts offer."""
        known = architecture.with_hosts(name for name in sorted(self.others) if self.is_there(name))
        return with_offers(known, {name: other.offer for name, other in self.others.items()})

    async def processes(self, revision: int) -> dict[str, ProcessStatus]:
        """Ask every host which processes it runs; an empty update asks that, and fences older managers.

        A host that is silent concerns only its own components. Raises ControlFailed if one refuses.
        """
        asked: set[str] = set()
        answered: set[str] = set()
        # The first host may report some that were not there, or not known, before.
        while names := {name for name in self.names if self.is_there(name)} - asked:
            asked |= names
            update = self._update({name: UpdateSpecs(revision, term=self.term) for name in names})
            _, failures = await update.answers()
            for error in failures.values():
                if not isinstance(error, NoAnswer):
                    raise error
            answered |= names - failures.keys()
        self.silent = frozenset(set(self.names) - answered)
        elsewhere = {p.component: p for host in self.others.values() for p in host.processes}
        return elsewhere | runs_of(*(self._told[name] for name in sorted(answered)))

    async def give(self, update: UpdateSpecs) -> dict[str, ProcessStatus]:
        """Give an update to the hosts it concerns; returns the processes that these then run. Raises ControlFailed."""
        return await self.begin_giving(update).processes()

    def begin_giving(self, update: UpdateSpecs) -> Update:
        """Give an update to the hosts it concerns, without waiting for the answers; raises NoAnswer.

        A spec concerns its host, any other that has a run of the component, and the first one. The first one gives it
        to a host that joins again. Topics and removed components concern all. A host that is not there gets them when
        it joins, and has to if it is only silent. All keep checkpoints, so what is on trial, or undone, is news to all.
        """
        of_all = update.removed or update.topics or update.removed_topics
        concerned = {*self.names} if of_all else {spec.host for spec in update.specs}
        if self.others and update.specs:
            concerned.add(FIRST)
        has_run = {spec.name: {host for host, _ in self.runs(spec.name)} for spec in update.specs}
        keep = {*self.names} if update.on_trial or update.undoes is not None else set()
        left = keep.union(*has_run.values()) - concerned
        not_told = tuple(sorted(host for host in concerned | left if not self.is_there(host)))
        update = replace(update, term=self.term, not_told=not_told)
        updates = {}
        for host in filter(self.is_there, concerned | left):
            specs = tuple(spec for spec in update.specs if host in (spec.host, FIRST, *has_run[spec.name]))
            updates[host] = update if specs == update.specs else replace(update, specs=specs)
        return self._update(updates, frozenset(left))

    async def describe(self, spec: ComponentSpec) -> DescribedComponent:
        """Ask a component's host what the component would be; raises ControlFailed."""
        answers = await self._ask_once_it_is_known(spec.host, "describe", codec.encode(DescribeComponent(spec)))
        return _read(spec.host, "describe", answers, DescribedComponent)

    async def estimate(self, host: str, wanted: EstimateQualities) -> EstimatedQualities:
        """Ask a host for the qualities that the classes which it can import estimate; raises ControlFailed."""
        answers = await self._ask_once_it_is_known(host, "estimate", codec.encode(wanted))
        return _read(host, "estimate", answers, EstimatedQualities)

    async def _ask_once_it_is_known(self, host: str, verb: str, payload: bytes) -> list[Answer]:
        """Ask a host what may be asked twice; raises ControlFailed.

        A host that has just joined is there before the manager's part of the bus knows what it answers.
        """
        patience = Patience(JUST_JOINED)
        while True:
            if not self.is_there(host):
                raise NoAnswer(self.why_not_there(host))
            answers = await self._ask(host, verb, payload, DESCRIBED_TIMEOUT)
            if answers or patience.is_over():
                return answers
            await self._kit.compute(time.sleep, ASK_AGAIN_INTERVAL)

    async def start(
        self, component: str, host: str, resume: bool, *, leave_out: int = 0, afresh: bool = False
    ) -> dict[str, ProcessStatus]:
        """Have a component's process started; returns the processes of the host. Raises ControlFailed."""
        message = StartComponent(component, term=self.term, resume=resume, leave_out=leave_out, afresh=afresh)
        asked = self._ask(host, "start", codec.encode(message))
        status = _read(host, "start", await asked, HostStatus)
        self._learn(status)
        return runs_of(status)

    async def succeed(self, spec: ComponentSpec, incumbent: int, home: str, with_state: bool) -> None:
        """Have a successor started next to a component's run, which is on the host ``home``; raises ControlFailed."""
        wanted = StartSuccessor(spec, incumbent, with_state, self.term)
        if home != spec.host:
            if not self.is_there(spec.host):
                raise NoAnswer(self.why_not_there(spec.host))
            kept = await self._succeed(home, wanted)
            wanted = replace(wanted, incarnation=_highest(kept, spec.name))
        await self._succeed(spec.host, wanted)

    async def _succeed(self, host: str, wanted: StartSuccessor) -> HostStatus:
        asked = self._ask(host, "succeed", codec.encode(wanted))
        status = _read(host, "succeed", await asked, HostStatus)
        self._learn(status)
        return status

    async def let_speak(
        self, component: str, host: str, started_as: int, above: int | None = None, elsewhere: str = ""
    ) -> None:
        """Notify a host which run speaks for a component, its own or one ``elsewhere``; raises ControlFailed.

        ``above`` makes it speak as another incarnation, higher than that.
        """
        asked = self._ask(host, "speak", codec.encode(LetSpeak(component, started_as, above, self.term, elsewhere)))
        self._learn(_read(host, "speak", await asked, HostStatus))

    async def stop(self, component: str, host: str, grace: float, started_as: int | None = None) -> None:
        """Have a component's process ended, by force after ``grace`` seconds; raises ControlFailed.

        ``started_as`` names a run, by the incarnation as which it was started; None means who speaks for the component.
        """
        asked = self._ask(host, "stop", codec.encode(StopComponent(component, grace, self.term, started_as)))
        self._learn(_read(host, "stop", await asked, HostStatus))

    async def last_line(self, component: str, host: str) -> str:
        """Return the last line of a component's log, empty if there is none or the host does not answer."""
        try:
            asked = self._ask(host, "logs", codec.encode(LogRequest(component, 20)))
            lines = _read(host, "logs", await asked, LogLines).lines
        except ControlFailed:
            return ""
        return next((line.strip() for line in reversed(lines) if line.strip()), "")


def _all_of(status: HostStatus) -> tuple[ProcessStatus, ...]:
    return (*status.processes, *status.beside)


def _highest(status: HostStatus, component: str) -> int:
    return max(process.max_incarnation for process in _all_of(status) if process.component == component)


def _read(host: str, verb: str, answers: list[Answer], cls: type[M]) -> M:
    if not answers:
        raise NoAnswer(f"host {host!r}: {verb}: no answer")
    good = next((answer for answer in answers if not answer.error), None)
    if good is None:
        raise refusal(f"host {host!r}", verb, answers[0])
    try:
        return codec.decode(good.payload, cls)
    except BadMessage as error:
        raise ControlFailed(f"host {host!r}: {verb}: a reply that cannot be read: {error}") from None
