"""Reads the body of a request: strict JSON, of a bounded size, with everything wrong reported by field.

Pydantic's JSON parser serves no strict reader: of a name that is given twice it takes the last, and 1e999 is infinite.
"""

from __future__ import annotations

import json
import math
from collections import Counter
from collections.abc import Callable, Coroutine
from typing import Any, NoReturn, TypeVar

from fastapi import Request, Response
from fastapi.routing import APIRoute
from starlette.concurrency import run_in_threadpool

from regraft.bus_schema.errors import BadMessage
from regraft.dashboard_api.http.problems import (
    BAD_CONTENT_TYPE,
    Problem,
    known_fields,
    malformed,
    misfit,
    told,
    violation,
)

T = TypeVar("T")

JSON_TYPES = ("application/json", "application/merge-patch+json")

SMALL = 16 * 1024
"""Bytes that are read at once: what is longer would keep others waiting, and is read and checked by a thread."""

MAX_WHOLE = 309
"""Digits of the largest number that JSON's readers commonly take, about 1.8e308."""


class JsonRoute(APIRoute):
    """A route that takes strict JSON; raises Problem for any other body."""

    def get_route_handler(self) -> Callable[[Request], Coroutine[Any, Any, Response]]:
        """Return what handles a request."""
        handle, body = super().get_route_handler(), self.body_field
        if body is None:
            return handle

        async def read(request: Request) -> Response:
            strict = _JsonRequest(request.scope, request.receive)
            if await strict.body() or body.field_info.is_required():
                _check_content_type(request)
            return await handle(strict)

        return read


class _JsonRequest(Request):
    """A request as FastAPI asks it for its body."""

    async def json(self) -> Any:
        """Return what the body holds; raises Problem."""
        raw = await self.body()
        return _parsed(raw) if len(raw) <= SMALL else await run_in_threadpool(self._checked, raw)

    def _checked(self, raw: bytes) -> Any:
        route: APIRoute = self.scope["route"]
        assert route.body_field
        value, errors = route.body_field.validate(_parsed(raw), loc=("body",))
        if errors:
            raise misfit(errors, known_fields(route))
        return value


def built(cls: Callable[..., T], *values: Any, **fields: Any) -> T:
    """Return a record of the fields of a body and of what else is known; raises Problem where they do not fit."""
    try:
        return cls(*values, **fields)
    except BadMessage as error:
        raise malformed(told(error)) from None


def _check_content_type(request: Request) -> None:
    content_type = request.headers.get("content-type", "").partition(";")[0].strip().lower()
    if content_type not in JSON_TYPES:
        raise Problem(BAD_CONTENT_TYPE, f"the body is {content_type or 'of no stated type'!r}: send application/json")


def _parsed(raw: bytes) -> Any:
    try:
        return json.loads(
            raw,
            parse_constant=_refuse_constant,
            parse_float=_finite,
            parse_int=_whole,
            object_pairs_hook=_object,
        )
    except UnicodeError:
        raise _not_strict("is not valid Unicode text in UTF-8") from None
    except RecursionError:
        raise _not_strict("is nested too deeply") from None
    except ValueError as error:
        raise _not_strict(f"is not JSON: {error}") from None


def _not_strict(why: str) -> Problem:
    return malformed(violation("", f"the body {why}"))


def _refuse_constant(name: str) -> NoReturn:
    raise _not_strict(f"holds {name}, which is no JSON value")


def _finite(digits: str) -> float:
    number = float(digits)
    if math.isinf(number):
        raise _not_strict(f"holds {digits[:40]}: a JSON number goes to about 1.8e308 here")
    return number


def _whole(digits: str) -> int:
    if len(digits) > MAX_WHOLE:
        shown = f"{digits[:40]}... ({len(digits)} digits)"
        raise _not_strict(f"holds {shown}, which is too large: a whole JSON number must fit into 64 bits here")
    return int(digits)


def _object(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    value = dict(pairs)
    if len(value) != len(pairs):
        twice = sorted(name for name, times in Counter(name for name, _ in pairs).items() if times > 1)
        raise _not_strict(f"gives {', '.join(map(repr, twice))} twice in one object")
    return value
