"""What the manager asks of hosts: what they were given, which processes run, and to take over new specs."""

from __future__ import annotations

import contextlib
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, TypeVar

from adaptation_manager.controls import BESIDE, ControlFailed, NoAnswer, refusal
from bus_schema import codec
from bus_schema.architecture import ComponentSpec
from bus_schema.errors import BadMessage
from bus_schema.keys import Keys
from bus_schema.messages.host import (
    DescribeComponent,
    DescribedComponent,
    HostStatus,
    HostView,
    LetSpeak,
    LogLines,
    LogRequest,
    ProcessStatus,
    StartComponent,
    StartSuccessor,
    StopComponent,
    UpdateSpecs,
)
from regraft.bus import Answer, BusError
from regraft.runtime.tasks import Waiting

if TYPE_CHECKING:
    from regraft.runtime.kit import Kit

M = TypeVar("M", HostStatus, HostView, DescribedComponent, LogLines)

DESCRIBED_WITHIN = 25.0
"""Seconds that a host may take to describe a component: more than it gives the process that imports the class."""


@dataclass(frozen=True, slots=True)
class Update:
    """New specs under way to hosts: all are asked even if one fails, so that a restoration reaches whom it can."""

    waiting: dict[str, Waiting[list[Answer]]]

    async def processes(self) -> dict[str, ProcessStatus]:
        """Return the processes that the hosts run now that they have the specs; raises ControlFailed."""
        processes, failures = await self.answers()
        if failures:
            raise ControlFailed("; ".join(map(str, failures.values())), next(iter(failures.values())).code)
        return processes

    async def answers(self) -> tuple[dict[str, ProcessStatus], dict[str, ControlFailed]]:
        """Return the processes of the hosts that answered, and what went wrong with the others."""
        processes: dict[str, ProcessStatus] = {}
        failures: dict[str, ControlFailed] = {}
        for host, waiting in self.waiting.items():
            try:
                status = _read(host, "specs", await waiting, HostStatus)
            except ControlFailed as error:
                failures[host] = error
                continue
            processes |= runs_of(status)
        return processes, failures


def runs_of(status: HostStatus) -> dict[str, ProcessStatus]:
    """Return a host's processes by component, those that stand beside one under its name and a plus sign."""
    beside = {f"{process.component}{BESIDE}": process for process in status.beside}
    return {process.component: process for process in status.processes} | beside


class Hosts:
    """The hosts of one system: ``names`` are known, ``silent`` did not say which processes they run."""

    def __init__(self, kit: Kit, within: float) -> None:
        """Know none yet; an answer may take ``within`` seconds."""
        self.names: tuple[str, ...] = ()
        self.silent: frozenset[str] = frozenset()
        self.term = 0
        self._within = within
        self._kit = kit
        self._keys = Keys(kit.system)

    def _ask(self, host: str, verb: str, payload: bytes, within: float | None = None) -> Waiting[list[Answer]]:
        try:
            return self._kit.ask(self._keys.host(host, verb), payload, within or self._within)
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
        return views

    def _update(self, updates: dict[str, UpdateSpecs]) -> Update:
        return Update({host: self._ask(host, "specs", codec.encode(updates[host])) for host in sorted(updates)})

    async def processes(self, revision: int) -> dict[str, ProcessStatus]:
        """Ask every host which processes it runs; an empty update asks that, and fences older managers.

        A host that is silent concerns only its own components. Raises ControlFailed if one refuses.
        """
        asked = self._update({name: UpdateSpecs(revision, term=self.term) for name in self.names})
        processes, failures = await asked.answers()
        for error in failures.values():
            if not isinstance(error, NoAnswer):
                raise error
        self.silent = frozenset(failures)
        return processes

    async def give(self, update: UpdateSpecs) -> dict[str, ProcessStatus]:
        """Give an update to the hosts it concerns; returns the processes that these then run. Raises ControlFailed."""
        return await self.begin_giving(update).processes()

    def begin_giving(self, update: UpdateSpecs) -> Update:
        """Give an update to the hosts it concerns, without waiting for the answers; raises NoAnswer.

        A spec concerns its host; topics, and that components are not there any more, concern all.
        """
        update = replace(update, term=self.term)
        of_all = update.removed or update.topics or update.removed_topics
        concerned = self.names if of_all else sorted({spec.host for spec in update.specs})
        return self._update(
            {
                host: replace(update, specs=tuple(spec for spec in update.specs if spec.host == host))
                for host in concerned
            }
        )

    async def describe(self, spec: ComponentSpec) -> DescribedComponent:
        """Ask a component's host what the component would be; raises ControlFailed."""
        asked = self._ask(spec.host, "describe", codec.encode(DescribeComponent(spec)), DESCRIBED_WITHIN)
        return _read(spec.host, "describe", await asked, DescribedComponent)

    async def start(self, component: str, host: str, resume: bool) -> dict[str, ProcessStatus]:
        """Have a component's process started; returns the processes of the host. Raises ControlFailed."""
        asked = self._ask(host, "start", codec.encode(StartComponent(component, term=self.term, resume=resume)))
        return runs_of(_read(host, "start", await asked, HostStatus))

    async def succeed(self, spec: ComponentSpec, incumbent: int, with_state: bool) -> dict[str, ProcessStatus]:
        """Have a successor started beside a component's run; returns the host's processes. Raises ControlFailed."""
        wanted = StartSuccessor(spec, incumbent, with_state, self.term)
        asked = self._ask(spec.host, "succeed", codec.encode(wanted))
        return runs_of(_read(spec.host, "succeed", await asked, HostStatus))

    async def let_speak(
        self, component: str, host: str, begun: int, above: int | None = None
    ) -> dict[str, ProcessStatus]:
        """Tell a host which run speaks for a component; returns its processes. Raises ControlFailed.

        ``above`` makes it speak as another incarnation, higher than that.
        """
        asked = self._ask(host, "speak", codec.encode(LetSpeak(component, begun, above, self.term)))
        return runs_of(_read(host, "speak", await asked, HostStatus))

    async def stop(self, component: str, host: str, grace: float, begun: int | None = None) -> None:
        """Have a component's process ended, by force after ``grace`` seconds; raises ControlFailed.

        ``begun`` names a run, by the incarnation as which it was started; None means who speaks for the component.
        """
        asked = self._ask(host, "stop", codec.encode(StopComponent(component, grace, self.term, begun)))
        _read(host, "stop", await asked, HostStatus)

    async def last_line(self, component: str, host: str) -> str:
        """Return the last line of a component's log, empty if there is none or the host does not say."""
        try:
            asked = self._ask(host, "logs", codec.encode(LogRequest(component, 20)))
            lines = _read(host, "logs", await asked, LogLines).lines
        except ControlFailed:
            return ""
        return next((line.strip() for line in reversed(lines) if line.strip()), "")


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
