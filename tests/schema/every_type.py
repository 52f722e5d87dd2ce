"""Properties that every message type has."""

from __future__ import annotations

from collections.abc import Callable, Iterable

from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from regraft.bus_schema.encoding.registry import MessageType
from tests.support.tables import check_each

from .strategies import all_types

KINDS = all_types()
Property = Callable[[MessageType, st.DataObject], None]


def of_every_type(examples: int = 8, kinds: Iterable[MessageType] = KINDS) -> Callable[[Property], Callable[[], None]]:
    """Make one test of a property: it tries so many examples of each type, and tells all types that lack it."""

    def make(holds: Property) -> Callable[[], None]:
        def check(kind: MessageType) -> None:
            @settings(max_examples=examples, deadline=None, suppress_health_check=list(HealthCheck), database=None)
            @given(st.data())
            def of_kind(data: st.DataObject) -> None:
                holds(kind, data)

            of_kind()

        def test() -> None:
            check_each(kinds, check, lambda kind: kind.name)

        test.__name__ = holds.__name__
        return test

    return make
