"""The kit that a component's author has as ``self.kit``."""

from __future__ import annotations

import logging
from collections.abc import Callable, Coroutine
from types import TracebackType
from typing import Any, Protocol, TypeVar

from regraft.bus.interface import Answer, Bus
from regraft.bus_schema.messages.health import Level
from regraft.bus_schema.messages.quality import Quality
from regraft.component.future import Future
from regraft.component.goal import Goal
from regraft.component.live_ports import Inputs, Outputs
from regraft.component.parameters import ParameterSet

R = TypeVar("R")
A = TypeVar("A")
F = TypeVar("F")


class Task(Protocol):
    """A coroutine that runs next to others of its component."""

    @property
    def finished(self) -> bool:
        """Whether it has ended."""

    def cancel(self) -> None:
        """Raise ``Cancelled`` in the coroutine where it awaits."""


class ExclusiveSlot(Protocol):
    """A pause of simulated time, held by one component: ``async with kit.exclusive() as slot``."""

    async def __aenter__(self) -> ExclusiveSlot: ...

    def touch(self, component: str) -> None:
        """Name a component whose wiring or timing may change in the slot."""

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None: ...


class Kit(Protocol):
    """Time, waiting, asking others, reporting progress. Times are seconds on the component's clock."""

    @property
    def name(self) -> str:
        """The component's name in the system."""

    @property
    def system(self) -> str:
        """The system's name."""

    @property
    def scope(self) -> str:
        """The robot among several that the component belongs to, by whose names it calls services; empty for none."""

    @property
    def seed(self) -> int:
        """The run's seed: everything random in a component derives from it and the component's name."""

    @property
    def parameters(self) -> ParameterSet:
        """The component's parameters."""

    @property
    def inputs(self) -> Inputs:
        """The component's inputs by name."""

    @property
    def outputs(self) -> Outputs:
        """The component's outputs by name."""

    @property
    def log(self) -> logging.Logger:
        """The component's log."""

    # --- time ---

    def now(self) -> float:
        """Return the time in seconds."""

    @property
    def simulated(self) -> bool:
        """Whether time is simulated."""

    @property
    def tick(self) -> int | None:
        """The world tick that this component is in, None in real time."""

    def sleep(self, seconds: float) -> Future[None]:
        """``await`` it: continue after ``seconds``."""

    # --- asking others ---

    def call(self, service: str, request: object, reply: type[A], *, timeout: float = 5.0) -> Future[A]:
        """``await`` it: the reply of a service, or CallFailed, at the latest after ``timeout`` seconds.

        Within a robot among several, the name is one of that robot's; with a leading ``/`` it is shared by all.
        """

    def goal(
        self,
        service: str,
        goal: object,
        result: type[A],
        feedback: type[F] | None = None,
        *,
        accept_within: float = 5.0,
        on_feedback: Callable[[F], None] | None = None,
        outlives: bool = False,
    ) -> Goal[A, F]:
        """Give an action a goal; ``await goal.outcome()`` or look at it now and then.

        It is cancelled when this run ends, however that happens, unless it ``outlives`` it.
        """

    def feedback(self, message: object) -> None:
        """Report progress to the client of the goal that the calling action pursues."""

    @property
    def goal_id(self) -> str:
        """The name of the goal that the calling action pursues, unlike that of any other; also in a successor.

        An action with several goals keeps under it how far each has come. Empty outside of an action.
        """

    @property
    def asked_by(self) -> str:
        """The caller of the running ``async`` service or action: a component's or client's name."""

    # --- doing several things ---

    def spawn(self, coroutine: Coroutine[Any, Any, R], name: str = "task") -> Task:
        """Run a coroutine next to the others until it ends or the component is deactivated."""

    def compute(self, function: Callable[..., R], *arguments: Any) -> Future[R]:
        """``await`` it: the result of heavy work, done on another thread while this component continues.

        Under simulated time the step waits for it, so that it takes no simulated time.
        """

    # --- reporting progress ---

    def event(self, kind: str, text: str, **details: Any) -> None:
        """Report something that happened once; ``kind`` is dotted, such as ``battery.low``."""

    def diagnose(self, subject: str, level: Level, text: str, **values: Any) -> None:
        """Put a diagnostic about a part of the component."""

    def report_quality(self, quality: Quality) -> None:
        """Report, now and to later queries, how a quality requirement is met; its name must fit into a key."""

    def set_status_text(self, detail: str, **values: Any) -> None:
        """Put a short text into the component's status, and the same as plain ``values`` for programs.

        It replaces the text and the values before it.
        """

    def fail(self, why: str) -> None:
        """Leave for errorprocessing and ``on_error`` as soon as the calling handler, hook or task step returns.

        The component is unconfigured then, or finalized if ``on_error`` raises, until somebody configures it again.
        """

    def recovered(self) -> None:
        """Report that what ``fail`` was called for is over. The state stays; the component can be configured again."""

    def checkpoint(self) -> None:
        """Publish a checkpoint now: for a state that changes seldom, instead of the class's ``checkpoint_every``."""

    def hold_time(self, hold: bool) -> None:
        """Have simulated time stand still from the end of this tick on, or let it continue.

        Meanwhile the component handles what comes from outside, such as a command. Under the real clock, and of an
        onlooker, it does nothing. Time continues when the component's run ends.
        """

    # --- for the adaptation manager and other tools that act on components ---

    @property
    def bus(self) -> Bus:
        """The component's own session, for tools that look on from outside the component's loop."""

    def exclusive(self) -> ExclusiveSlot:
        """``async with`` it: under simulated time, an exclusive slot in which nothing else runs.

        In it, await only ``ask`` and ``compute``: no time passes and no message comes, so a task that waits for those
        is cancelled.
        """

    def ask(self, key: str, payload: bytes, timeout: float) -> Future[list[Answer]]:
        """``await`` it: the answers to a query on the bus; under simulated time only within an exclusive slot."""
