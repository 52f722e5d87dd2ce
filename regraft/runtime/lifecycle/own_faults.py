"""Faults that a component is made to have: its loop hangs, a handler raises, or handlers take longer."""

from __future__ import annotations

import inspect
import time
from collections import deque
from collections.abc import Callable
from functools import wraps
from typing import Any

from regraft.bus_schema.encoding import codec
from regraft.bus_schema.messages.protocol.control import ControlCode
from regraft.bus_schema.messages.protocol.faults import FaultInjected
from regraft.bus_schema.model.scheduled_faults import FaultKind, ScheduledFault
from regraft.runtime.core.control_refusal import ControlRefused
from regraft.runtime.parts import Parts

MAX_REMEMBERED = 1000
"""Faults that are known to have begun, should their host ask again."""


class InjectedFault(Exception):
    """Raised in a handler because the schedule of the run wants it."""


class OwnFaults:
    """Carries out the faults of one component. Until the first of them, its handlers are called as they are."""

    def __init__(self, parts: Parts) -> None:
        self._parts = parts
        self._wrapped = False
        self._delay = 0.0
        self._to_raise = 0
        self._begun: deque[ScheduledFault] = deque(maxlen=MAX_REMEMBERED)

    def inject(self, payload: bytes) -> FaultInjected:
        """Begin with a fault, once; one that ends the run by a signal is the host's matter.

        Raises:
            ControlRefused: the fault is not on the schedule of the run.
        """
        fault = codec.decode(payload, ScheduledFault)
        if fault not in self._parts.assignment.faults:
            raise ControlRefused(ControlCode.REFUSED, f"'{fault}' is not on the schedule of this run")
        if fault not in self._begun:
            self._begun.append(fault)
            self._begin(fault)
        assignment = self._parts.assignment
        return FaultInjected(assignment.name, assignment.incarnation)

    def _begin(self, fault: ScheduledFault) -> None:
        if fault.kind is FaultKind.HANG:
            self._parts.post(_hang)
        elif fault.kind is FaultKind.EXCEPTION:
            self._to_raise += 1
            self._wrap()
        elif fault.kind is FaultKind.SLOW:
            self._delay = fault.delay
            self._wrap()

    def _wrap(self) -> None:
        if self._wrapped:
            return
        self._wrapped = True
        parts = self._parts
        parts.around = self._around
        for port in parts.inputs.values():
            port.wrap(self._around)
        for server in parts.servers:
            server.wrap(self._around)
        for timer in parts.timers.periodic:
            if timer.name in parts.declared.timers:  # checkpoints and measurements are nobody's handlers
                timer.call = self._around(timer.call)

    def _around(self, call: Callable[..., Any]) -> Callable[..., Any]:
        """Return a handler that first has the fault that is due."""
        if inspect.iscoroutinefunction(call):

            @wraps(call)
            async def asynchronous(*arguments: Any) -> Any:
                self._fail()
                return await call(*arguments)

            return asynchronous

        def synchronous(*arguments: Any) -> Any:
            self._fail()
            return call(*arguments)

        return synchronous

    def _fail(self) -> None:
        if self._delay:
            time.sleep(self._delay)
        if self._to_raise:
            self._to_raise -= 1
            raise InjectedFault("on the schedule of this run")


def _hang() -> None:
    while True:
        time.sleep(1.0)
