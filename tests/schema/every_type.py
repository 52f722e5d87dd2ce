"""Properties that every message type has."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any

from hypothesis import HealthCheck, Phase, given, settings

from regraft.bus_schema.encoding.registry import MessageType
from tests.schema.strategies import all_types, values
from tests.support.tables import check_each

KINDS = all_types()
MESSAGES = 10
MessageProperty = Callable[[MessageType, Any], None]

_drawn: dict[str, list[Any]] = {}


def messages(kind: MessageType) -> list[Any]:
    """Return messages of a type, drawn once for all tests of this process: to draw one takes longer than to use it."""
    if kind.name not in _drawn:
        drawn: list[Any] = []

        @settings(
            max_examples=MESSAGES, suppress_health_check=list(HealthCheck), database=None, phases=[Phase.generate]
        )
        @given(values(kind.shape))
        def draw(message: object) -> None:
            drawn.append(message)

        draw()
        _drawn[kind.name] = drawn
    return _drawn[kind.name]


def of_every_message(kinds: Iterable[MessageType] = KINDS) -> Callable[[MessageProperty], Callable[[], None]]:
    """Make one test of a property that each of a type's ``messages`` has; it tells all types that lack it."""

    def make(holds: MessageProperty) -> Callable[[], None]:
        def check(kind: MessageType) -> None:
            for message in messages(kind):
                try:
                    holds(kind, message)
                except BaseException as error:
                    error.add_note(f"of {message!r}")
                    raise

        return _one_test(holds.__name__, kinds, check)

    return make


def _one_test(name: str, kinds: Iterable[MessageType], check: Callable[[MessageType], None]) -> Callable[[], None]:
    def test() -> None:
        check_each(kinds, check, lambda kind: kind.name)

    test.__name__ = name
    return test
