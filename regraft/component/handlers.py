"""Handlers of a component: ``@service``, ``@action``, ``@every``."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from dataclasses import dataclass, is_dataclass
from typing import Any, TypeVar, get_type_hints

from regraft.bus_schema.encoding.records import arrays_in, record_shape
from regraft.bus_schema.encoding.registry import type_of
from regraft.bus_schema.errors import BadType
from regraft.bus_schema.model.description import ServiceDescription
from regraft.component.parameters import Parameter

F = TypeVar("F", bound=Callable[..., Any])

MIN_PERIOD = 1e-4
"""Seconds: a handler that is called more often leaves no time for others. A parameter that asks for less gets this."""
MAX_RATE = 1e4
"""Hz."""
LONGEST = 1e9
"""Seconds: three decades."""


MAX_GOALS = 256
"""Goals that an action pursues at once at the most."""
NEVER = 2**62
"""Nanoseconds: a period that never ends."""


@dataclass(frozen=True, slots=True)
class Period:
    """How often a method is called: every ``seconds``, or ``hz`` times a second; a parameter may give the number."""

    seconds: float | Parameter[float] | None
    hz: float | Parameter[float] | None

    def nanoseconds(self, values: dict[str, Any]) -> int:
        """Return the period now, given the component's parameter values."""

        def number(given: float | Parameter[float]) -> float:
            value = values[given.name] if isinstance(given, Parameter) else given
            return float(value)

        if self.seconds is not None:
            return _bounded(number(self.seconds) * 1e9)
        assert self.hz is not None
        rate = number(self.hz)
        return _bounded(1e9 / rate) if rate > 0 else NEVER


def _bounded(nanoseconds: float) -> int:
    return round(min(max(nanoseconds, MIN_PERIOD * 1e9), LONGEST * 1e9))


@dataclass(frozen=True, slots=True)
class Service:
    """A service or, with ``action``, an action: its name and the message classes of its parts."""

    name: str
    method: str
    request: type
    reply: type
    action: bool
    feedback: type | None
    description: str
    goals: int = 0

    def describe(self) -> ServiceDescription:
        """Return the service's description."""
        return ServiceDescription(
            self.name,
            "action" if self.action else "service",
            type_of(self.request).name,
            type_of(self.reply).name,
            type_of(self.feedback).name if self.feedback else None,
            self.description,
            self.goals,
        )


@dataclass(frozen=True, slots=True)
class _Offer:
    name: str
    action: bool
    feedback: type | None
    goals: int = 0


def every(
    *, seconds: float | Parameter[float] | None = None, hz: float | Parameter[float] | None = None
) -> Callable[[F], F]:
    """Call the decorated method periodically while the component is active.

    Give ``seconds`` or ``hz``, a number or one of the class's parameters; a rate of 0 means never.
    Under simulated time it is called in the first world tick at or after its due time.

    Raises:
        TypeError: both are given, or none.
        ValueError: it could never be so, or as good as all the time (10 kHz is the most).
    """
    if (seconds is None) == (hz is None):
        raise TypeError("@every takes either seconds or hz")
    for name, given, least, most in (("seconds", seconds, MIN_PERIOD, LONGEST), ("hz", hz, 0.0, MAX_RATE)):
        number = given.default if isinstance(given, Parameter) else given
        if number is not None and not least <= number <= most:
            raise ValueError(f"@every({name}={number}): must be between {least:g} and {most:g}")

    def mark(function: F) -> F:
        function.__regraft_period__ = Period(seconds, hz)  # type: ignore[attr-defined]
        return function

    return mark


def service(name: str) -> Callable[[F], F]:
    """Offer the decorated method as a service: it takes a request message and returns the reply message."""
    return _offering(_Offer(name, action=False, feedback=None))


def action(name: str, *, feedback: type | None = None, goals: int = 1) -> Callable[[F], F]:
    """Offer the decorated ``async`` method as an action: it takes the goal and returns the result.

    It reports progress with ``self.kit.feedback(...)``; ``Cancelled`` is raised in it where it awaits. It pursues so
    many ``goals`` at once, each in a call of its own. With one, a newer goal ends the older one. With more, a goal
    beyond them is refused with the code ``busy``.

    Raises:
        ValueError: it could pursue no goal, or more than 256.
    """
    if isinstance(goals, bool) or not isinstance(goals, int) or not 1 <= goals <= MAX_GOALS:
        raise ValueError(f"@action({name!r}, goals={goals!r}): must be a whole number from 1 to {MAX_GOALS}")
    return _offering(_Offer(name, action=True, feedback=feedback, goals=goals))


def _offering(offer: _Offer) -> Callable[[F], F]:
    def mark(function: F) -> F:
        if offer.action and not inspect.iscoroutinefunction(function):
            raise TypeError(f"the action {offer.name!r} must be an async method")
        function.__regraft_offer__ = offer  # type: ignore[attr-defined]
        return function

    return mark


def service_of(method: str, function: Callable[..., Any]) -> Service | None:
    """Return the service that a method offers, None if it offers none; raises BadType if it is ill-typed."""
    offer: _Offer | None = getattr(function, "__regraft_offer__", None)
    if offer is None:
        return None
    hints = get_type_hints(function)
    reply = hints.pop("return", None)
    if len(hints) != 1 or reply is None:
        raise BadType(f"{function.__qualname__} must take one annotated message and be annotated with its reply")
    text = inspect.getdoc(function) or ""
    (request,) = hints.values()
    for part in (request, reply, offer.feedback):
        if is_dataclass(part) and isinstance(part, type) and any(arrays_in(record_shape(part))):
            why = f"{part.__qualname__} holds an array, which no request, reply or feedback can"
            raise BadType(f"{function.__qualname__}: {why}: publish it on a topic, or make it a tuple or bytes")
    return Service(offer.name, method, request, reply, offer.action, offer.feedback, text.split("\n")[0], offer.goals)


def is_offered_or_timed(function: Callable[..., Any]) -> bool:
    """Return whether a method is marked with ``@service``, ``@action`` or ``@every``."""
    return hasattr(function, "__regraft_offer__") or hasattr(function, "__regraft_period__")


def period_of(function: Callable[..., Any]) -> Period | None:
    """Return the period of a method marked with ``@every``, None for others."""
    period: Period | None = getattr(function, "__regraft_period__", None)
    return period
