"""Refuses query parameters that a route does not have: without one that is misspelt, something else would be done."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator

from fastapi import Request
from fastapi.dependencies.models import Dependant

from regraft.bus_schema.model.adaptation import Violation
from regraft.bus_schema.suggestions import Hints
from regraft.dashboard_api.http.problems import malformed, violation


async def check_query(request: Request) -> None:
    """Raise Problem if a request gives parameters that its route does not have, or one of them twice."""
    wrong = tuple(_misfits(request))
    if wrong:
        raise malformed(*wrong)


def _misfits(request: Request) -> Iterator[Violation]:
    given = Counter(name for name, _ in request.query_params.multi_items())
    known = set(_parameters(request.scope["route"].dependant)) if given else set()
    hints = Hints(known)
    for name, times in given.items():
        if name not in known:
            yield violation(name, f"there is no such parameter; {hints.instead_of(name)}")
        elif times > 1:
            yield violation(name, "is given more than once")


def _parameters(dependant: Dependant) -> Iterator[str]:
    """Return the names of the query parameters of a route, those of what it depends on included."""
    yield from (field.alias for field in dependant.query_params)
    for other in dependant.dependencies:
        yield from _parameters(other)
