"""What a component's author has of the kit, as ``self.kit``."""

from __future__ import annotations

import logging
from collections.abc import Callable, Coroutine
from concurrent.futures import Future
from typing import TYPE_CHECKING, Any, TypeVar

from bus_schema.messages.health import Level
from bus_schema.messages.quality import Quality
from regraft.bus import Answer, Bus
from regraft.runtime.calling import Goal
from regraft.runtime.exclusive import Exclusive
from regraft.runtime.inputs import Inputs
from regraft.runtime.outputs import Outputs
from regraft.runtime.tasks import Task, Waiting

if TYPE_CHECKING:
    from regraft.parameters import ParameterSet
    from regraft.runtime.runtime import Runtime

R = TypeVar("R")
A = TypeVar("A")
F = TypeVar("F")


class Kit:
    """Time, waiting, asking others, telling how things are. Times are seconds on the component's clock."""

    def __init__(self, runtime: Runtime) -> None:
        """Wrap the runtime; authors are given one."""
        self._runtime = runtime

    @property
    def name(self) -> str:
        """The component's name in the system."""
        return self._runtime.assignment.name

    @property
    def system(self) -> str:
        """The system's name."""
        return self._runtime.assignment.system

    @property
    def seed(self) -> int:
        """The run's seed: everything random in a component derives from it and the component's name."""
        return self._runtime.assignment.seed

    @property
    def parameters(self) -> ParameterSet:
        """The component's parameters."""
        return self._runtime.parameters

    @property
    def inputs(self) -> Inputs:
        """The component's inputs by name."""
        return self._runtime.inputs

    @property
    def outputs(self) -> Outputs:
        """The component's outputs by name."""
        return self._runtime.outputs

    @property
    def log(self) -> logging.Logger:
        """The component's log."""
        return self._runtime.herald.log

    # --- time ---

    def now(self) -> float:
        """Return the time in seconds."""
        return self._runtime.clock.now() / 1e9

    @property
    def simulated(self) -> bool:
        """Whether time is simulated."""
        return self._runtime.assignment.simulated

    @property
    def tick(self) -> int | None:
        """The world tick that this component is in, None in real time."""
        return self._runtime.tick

    def sleep(self, seconds: float) -> Waiting[None]:
        """``await`` it: go on after ``seconds``."""
        return self._runtime.timers.sleep_until(self._runtime.clock.now() + round(seconds * 1e9))

    # --- asking others ---

    def call(self, service: str, request: object, reply: type[A], *, timeout: float = 5.0) -> Waiting[A]:
        """``await`` it: the reply of a service, or CallFailed, at the latest after ``timeout`` seconds."""
        return self._runtime.caller.call(service, request, reply, timeout)

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
        return self._runtime.caller.goal(service, goal, result, feedback, accept_within, on_feedback, outlives=outlives)

    def feedback(self, message: object) -> None:
        """Tell the client of the goal that the calling action pursues how it goes."""
        task = self._runtime.tasks.current
        if task is None or task.goal is None:
            raise RuntimeError("kit.feedback is for actions: no goal is being pursued here")
        server, request = task.goal
        server.feedback(request, message)

    @property
    def asked_by(self) -> str:
        """Who asked for what the calling ``async`` service or action does: the component's or client's name."""
        task = self._runtime.tasks.current
        return task.asked_by if task is not None else ""

    # --- doing several things ---

    def spawn(self, coroutine: Coroutine[Any, Any, R], name: str = "task") -> Task:
        """Run a coroutine beside the others until it ends or the component is deactivated."""
        return self._runtime.spawn(name, coroutine)

    def compute(self, function: Callable[..., R], *arguments: Any) -> Waiting[R]:
        """``await`` it: the result of heavy work, done on another thread while this component goes on.

        Under simulated time the step waits for it, so that it takes no simulated time.
        """
        waiting: Waiting[R] = Waiting()

        def finished(future: Future[R]) -> None:
            self._runtime.post(lambda: self._runtime.computed(waiting, future))

        self._runtime.computing += 1
        self._runtime.executor.submit(function, *arguments).add_done_callback(finished)
        return waiting

    # --- telling how things are ---

    def event(self, kind: str, text: str, **details: Any) -> None:
        """Tell of something that happened once; ``kind`` is dotted, such as ``battery.low``."""
        self._runtime.herald.event(kind, text, **details)

    def diagnose(self, subject: str, level: Level, text: str, **values: Any) -> None:
        """Put a diagnostic about a part of the component."""
        self._runtime.herald.diagnose(subject, level, text, **values)

    def tell_quality(self, quality: Quality) -> None:
        """Tell, now and whoever asks, how a quality requirement is met; its name must be able to stand in a key."""
        self._runtime.tell_quality(quality)

    def say(self, detail: str, **values: Any) -> None:
        """Put a short text into the component's status, and the same as plain ``values`` for programs.

        It replaces the text and the values before it.
        """
        status = self._runtime.herald.status
        if (detail[:500], values) != (status.detail, status.values):
            self._runtime.herald.say(detail=detail[:500], values=values)

    # --- for the adaptation manager and other tools that act on components ---

    @property
    def bus(self) -> Bus:
        """The component's own session, for tools that look on from outside the component's loop."""
        return self._runtime.bus

    def exclusive(self) -> Exclusive:
        """``async with`` it: under simulated time, an exclusive slot in which nothing else runs.

        In it, await only ``ask`` and ``compute``: no time passes and no message comes, so whoever waits for those is
        cancelled.
        """
        return Exclusive(self._runtime)

    def ask(self, key: str, payload: bytes, timeout: float) -> Waiting[list[Answer]]:
        """``await`` it: the answers to a query on the bus; under simulated time only within an exclusive slot."""
        slots = self._runtime.slots
        if not slots.granted:
            raise RuntimeError("under simulated time, ask the bus within an exclusive slot: async with kit.exclusive()")
        waiting: Waiting[list[Answer]] = Waiting()

        def answered(answers: list[Answer]) -> None:
            slots.asking -= 1
            waiting.resolve(answers)

        self._runtime.bus.ask(key, payload, timeout, lambda answers: self._runtime.post(lambda: answered(answers)))
        slots.asking += 1
        return waiting
