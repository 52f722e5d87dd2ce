"""Typed control queries to the running components, fenced by the manager's term."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, TypeVar

from regraft import Future
from regraft.adaptation_manager.targets.view_cache import ViewCache
from regraft.bus.interface import Answer, BusError
from regraft.bus_schema.encoding import codec
from regraft.bus_schema.errors import BadMessage
from regraft.bus_schema.keys import Keys
from regraft.bus_schema.messages.management.qualities import MeasuredQualities
from regraft.bus_schema.messages.protocol.control import (
    ComponentView,
    ControlCode,
    ControlError,
    ParameterValues,
    Rewire,
    RewireStep,
    SetTransition,
)
from regraft.bus_schema.messages.protocol.handover import Handover
from regraft.bus_schema.messages.protocol.host import ProcessState, ProcessStatus
from regraft.bus_schema.model.lifecycle import Transition
from regraft.patience import stretched

if TYPE_CHECKING:
    from regraft import Kit

M = TypeVar("M")

LIVING = (ProcessState.STARTING, ProcessState.RUNNING)


BESIDE = "+"
"""Behind a component's name: its standby run, under the name that it has on the bus."""


class ControlFailed(Exception):
    """A component or host did not do what it was asked; the text names it and reports why."""

    def __init__(self, text: str, code: ControlCode | None = None) -> None:
        """Describe it in one line; ``code`` is that of an error reply, None where there was no reply."""
        self.code = code
        super().__init__(text)


class NoAnswer(ControlFailed):
    """Nobody answered: the process hangs or, if ``gone``, is not there any more."""

    def __init__(self, text: str, *, gone: bool = False) -> None:
        self.gone = gone
        super().__init__(text)


def refusal(who: str, what: str, answer: Answer) -> ControlFailed:
    """Return an error reply as an exception."""
    try:
        error = codec.decode(answer.payload, ControlError)
    except BadMessage as bad:
        return ControlFailed(f"{who}: {what}: an error reply that cannot be read: {bad}")
    return ControlFailed(f"{who}: {what}: {'; '.join(error.problems)}", error.code)


@dataclass(frozen=True, slots=True)
class PendingQuery:
    """A control query under way, to one run of a component; ``failure`` is why it could not even be sent.

    Its answer is ``remembered``; if it does not answer as it should, nothing of it is. It ``waits`` longer than
    ``within`` on a crowded machine.
    """

    remembered: ViewCache
    component: str
    incarnation: int
    what: str
    within: float
    waits: float
    sent: float
    waiting: Future[list[Answer]] | None
    failure: str = ""

    async def view(self) -> ComponentView:
        """Return the component as it is after the query; raises ControlFailed, NoAnswer."""
        try:
            view = await self._answer()
        except ControlFailed:
            self.remembered.forget(self.component)
            raise
        if view.component == self.component:
            self.remembered.note(view)
        return view

    async def qualities(self) -> MeasuredQualities:
        """Return what the component has measured last; raises ControlFailed, NoAnswer."""
        return await self._decoded(MeasuredQualities)

    async def _answer(self) -> ComponentView:
        return await self._decoded(ComponentView)

    async def _decoded(self, kind: type[M]) -> M:
        if self.waiting is None:
            raise NoAnswer(f"{self.component}: {self.what}: {self.failure}", gone=True)
        answers = await self.waiting
        good = next((answer for answer in answers if not answer.error), None)
        if good is None and answers:
            raise refusal(self.component, self.what, answers[0])
        if good is None:
            raise self._silence()
        try:
            return codec.decode(good.payload, kind)
        except BadMessage as error:
            raise ControlFailed(f"{self.component}: {self.what}: a reply that cannot be read: {error}") from None

    def _silence(self) -> NoAnswer:
        # The bus answers at once when there is nobody to ask, after the time-out when somebody stays silent.
        gone = time.monotonic() - self.sent < 0.9 * self.waits
        crowded = f", which were {self.waits:.0f} s on a crowded machine" if self.waits > self.within else ""
        why = "its process is not on the bus" if gone else f"no answer within {self.within:g} s{crowded}"
        return NoAnswer(f"{self.component}: {self.what}: {why}", gone=gone)


class ComponentClient:
    """Asks components; knows from the hosts which run of each is the living one (``processes``).

    A name with a plus sign behind it is that of the standby run.
    """

    def __init__(self, kit: Kit, within: Callable[[], float]) -> None:
        """Know nobody yet; an answer may take ``within`` seconds."""
        self._within = within
        self.remembered = ViewCache(kit.bus, kit.system)
        self.term = 0
        self.processes: dict[str, ProcessStatus] = {}
        self._kit = kit
        self._keys = Keys(kit.system)

    def is_living(self, run: PendingQuery | ComponentView) -> bool:
        """Return whether a query went to, or a view is of, the component's living run."""
        process = self.living(run.component)
        return process is not None and process.incarnation == run.incarnation

    def last_answer(self, component: str, host: str) -> ComponentView | None:
        """Return what a component answered last, None unless it must still be so."""
        view = self.remembered.view(component, host)
        return view if view is not None and self.is_living(view) else None

    def living(self, component: str) -> ProcessStatus | None:
        """Return the component's running process, None if there is none."""
        process = self.processes.get(component)
        return process if process and process.state in LIVING else None

    def _begin(self, component: str, verb: str, what: str, message: object, within: float | None) -> PendingQuery:
        within = self._within() if within is None else within
        sent = time.monotonic()
        process = self.living(component)
        if process is None:
            return PendingQuery(self.remembered, component, 0, what, within, within, sent, None, "it is not running")
        return self._ask(component, process.incarnation, verb, what, message, within)

    def _ask(self, component: str, run: int, verb: str, what: str, message: object, within: float) -> PendingQuery:
        waits, sent = stretched(within), time.monotonic()
        key = self._keys.control(component.removesuffix(BESIDE), run, verb)
        payload = b"" if message is None else codec.encode(message)
        try:
            waiting = self._kit.ask(key, payload, waits)
        except BusError as error:
            return PendingQuery(self.remembered, component, run, what, within, waits, sent, None, str(error))
        return PendingQuery(self.remembered, component, run, what, within, waits, sent, waiting)

    def hand_over(self, component: str, started_as: int, step: Handover, within: float | None = None) -> PendingQuery:
        """Ask one run of a component, by the incarnation as which it was started, for a step of a hand-over."""
        self.remembered.forget(component)
        within = self._within() if within is None else within
        label = f"{component}{BESIDE}"  # its roles may change: its answer is not to be kept
        message = replace(step, term=self.term)
        return self._ask(label, started_as, "handover", f"{step.step.value} of run {started_as}", message, within)

    def read(self, component: str, within: float | None = None) -> PendingQuery:
        """Ask how a component is."""
        return self._begin(component, "connections", "reading it", Rewire(RewireStep.READ), within)

    def read_qualities(self, component: str) -> PendingQuery:
        """Ask what a component has measured last."""
        return self._begin(component, "qualities", "reading its qualities", None, None)

    def set_parameters(self, component: str, values: dict[str, object], revision: int) -> PendingQuery:
        """Ask a component to set several parameters."""
        message = ParameterValues(values, self.term, revision)
        return self._begin(component, "parameters", f"setting {', '.join(sorted(values))}", message, None)

    def transition(
        self, component: str, transition: Transition, revision: int, within: float | None = None, *, hold: bool = False
    ) -> PendingQuery:
        """Ask a component for a transition; ``hold`` as in ``SetTransition``."""
        message = SetTransition(transition, self.term, revision, hold, round(self._kit.now() * 1e9))
        return self._begin(component, "transition", transition.value, message, within)

    def rewire(self, component: str, step: Rewire, within: float | None = None) -> PendingQuery:
        """Ask a component for a step of rewiring."""
        what = " ".join(filter(None, (step.step.value, step.port, step.topic and f"on {step.topic!r}")))
        return self._begin(component, "connections", what, replace(step, term=self.term), within)

    def claim(self, component: str) -> PendingQuery:
        """Notify a component of the term, so that it refuses an older manager; changes nothing else."""
        return self.rewire(component, Rewire(RewireStep.ABANDON))
