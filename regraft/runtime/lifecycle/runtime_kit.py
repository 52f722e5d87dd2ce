"""The kit of a component that runs."""

from __future__ import annotations

import logging
from collections.abc import Callable, Coroutine
from dataclasses import replace
from typing import Any, TypeVar

from regraft.bus.interface import Answer, Bus
from regraft.bus_schema.messages.health import Level
from regraft.bus_schema.messages.quality import Quality
from regraft.bus_schema.model.robots.scopes import component_in_scope
from regraft.component.future import Future
from regraft.component.goal import Goal
from regraft.component.handlers import LONGEST
from regraft.component.kit import ExclusiveSlot, Kit, Task
from regraft.component.live_ports import Inputs, Outputs
from regraft.component.parameters import ParameterSet
from regraft.runtime.core.exclusive import Exclusive
from regraft.runtime.parts import Parts

R = TypeVar("R")
A = TypeVar("A")
F = TypeVar("F")


class RuntimeKit(Kit):
    def __init__(self, parts: Parts) -> None:
        self._parts = parts

    @property
    def name(self) -> str:
        return self._parts.assignment.name

    @property
    def system(self) -> str:
        return self._parts.assignment.system

    @property
    def scope(self) -> str:
        return self._parts.assignment.scope

    @property
    def seed(self) -> int:
        return self._parts.assignment.seed

    @property
    def parameters(self) -> ParameterSet:
        return self._parts.parameters

    @property
    def inputs(self) -> Inputs:
        return self._parts.inputs

    @property
    def outputs(self) -> Outputs:
        return self._parts.outputs

    @property
    def log(self) -> logging.Logger:
        return self._parts.reporter.log

    # --- time ---

    def now(self) -> float:
        return self._parts.clock.now() / 1e9

    @property
    def simulated(self) -> bool:
        return self._parts.assignment.simulated

    @property
    def tick(self) -> int | None:
        return self._parts.tick

    def sleep(self, seconds: float) -> Future[None]:
        return self._parts.timers.sleep_until(self._parts.clock.now() + round(min(seconds, LONGEST) * 1e9))

    # --- asking others ---

    def call(self, service: str, request: object, reply: type[A], *, timeout: float = 5.0) -> Future[A]:
        return self._parts.requests.call(service, request, reply, timeout)

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
        return self._parts.requests.goal(service, goal, result, feedback, accept_within, on_feedback, outlives=outlives)

    def feedback(self, message: object) -> None:
        task = self._parts.tasks.current
        if task is None or task.goal is None:
            raise RuntimeError("kit.feedback is for actions: no goal is being pursued here")
        server, request = task.goal
        server.feedback(request, message)

    @property
    def goal_id(self) -> str:
        task = self._parts.tasks.current
        if task is None or task.goal is None:
            return ""
        _, request = task.goal
        return f"{request.client}/{request.number}"

    @property
    def asked_by(self) -> str:
        task = self._parts.tasks.current
        return task.asked_by if task is not None else ""

    # --- doing several things ---

    def spawn(self, coroutine: Coroutine[Any, Any, R], name: str = "task") -> Task:
        return self._parts.spawn(name, coroutine)

    def compute(self, function: Callable[..., R], *arguments: Any) -> Future[R]:
        return self._parts.compute.submit(function, *arguments)

    # --- reporting progress ---

    def event(self, kind: str, text: str, **details: Any) -> None:
        self._parts.reporter.event(kind, text, **details)

    def diagnose(self, subject: str, level: Level, text: str, **values: Any) -> None:
        self._parts.reporter.diagnose(subject, level, text, **values)

    def report_quality(self, quality: Quality) -> None:
        scope = self._parts.assignment.scope
        self._parts.presence.report_quality(
            replace(quality, requirement=component_in_scope(scope, quality.requirement))
        )

    def set_status_text(self, detail: str, **values: Any) -> None:
        status = self._parts.reporter.status
        if (detail[:500], values) != (status.detail, status.values):
            self._parts.reporter.update(detail=detail[:500], values=values)

    def fail(self, why: str) -> None:
        self._parts.failing = self._parts.failing or why or "no reason given"

    def recovered(self) -> None:
        self._parts.failing = ""
        self._parts.reporter.recovered("by_itself", "what had failed is over")

    def checkpoint(self) -> None:
        self._parts.guarded("checkpoint", self._parts.checkpoint)

    def hold_time(self, hold: bool) -> None:
        self._parts.holds_time = hold

    # --- for the adaptation manager and other tools that act on components ---

    @property
    def bus(self) -> Bus:
        return self._parts.bus

    def exclusive(self) -> ExclusiveSlot:
        return Exclusive(self._parts.slots, self._parts.tasks)

    def ask(self, key: str, payload: bytes, timeout: float) -> Future[list[Answer]]:
        slots = self._parts.slots
        if not slots.granted:
            raise RuntimeError("under simulated time, ask the bus within an exclusive slot: async with kit.exclusive()")
        waiting: Future[list[Answer]] = Future()

        def answered(answers: list[Answer]) -> None:
            slots.asking -= 1
            waiting.resolve(answers)

        self._parts.bus.ask(key, payload, timeout, lambda answers: self._parts.post(lambda: answered(answers)))
        slots.asking += 1
        return waiting
