"""Reads the body of a request: strict JSON, of a bounded size, with everything wrong told by field."""

from __future__ import annotations

import json
import math
from collections import Counter
from collections.abc import Iterable
from typing import Any

from starlette.concurrency import run_in_threadpool
from starlette.requests import Request

from regraft.bus_schema.errors import BadMessage
from regraft.bus_schema.suggestions import Hints
from regraft.dashboard_api.http.problems import BAD_CONTENT_TYPE, MAX_TOLD, Problem, malformed, violation

JSON_TYPES = ("application/json", "application/merge-patch+json")

SMALL = 16 * 1024
"""Bytes that are read at once: what is longer would keep others waiting, and is read by a thread."""

MAX_WHOLE = 309
"""Digits of the largest number that JSON's readers commonly take, about 1.8e308."""


class _NotStrict(ValueError):
    """Something that JSON proper does not have, or that has no one meaning."""


async def json_object(request: Request) -> dict[str, Any]:
    """Return the object that the body holds; raises Problem."""
    raw = await request.body()
    content_type = request.headers.get("content-type", "").partition(";")[0].strip().lower()
    if content_type not in JSON_TYPES:
        raise Problem(BAD_CONTENT_TYPE, f"the body is {content_type or 'of no stated type'!r}: send application/json")
    return _parsed(raw) if len(raw) <= SMALL else await run_in_threadpool(_parsed, raw)


async def optional_json_object(request: Request) -> dict[str, Any]:
    """Return the object that the body holds, an empty one for no body; raises Problem."""
    return await json_object(request) if await request.body() else {}


def _parsed(raw: bytes) -> dict[str, Any]:
    try:
        value = json.loads(
            raw,
            parse_constant=_refuse_constant,
            parse_float=_finite,
            parse_int=_whole,
            object_pairs_hook=_object,
        )
        json.dumps(value, ensure_ascii=False).encode()
    except UnicodeError:
        raise malformed(violation("", "the body is not valid Unicode text in UTF-8")) from None
    except _NotStrict as error:
        raise malformed(violation("", f"the body {error}")) from None
    except RecursionError:
        raise malformed(violation("", "the body is nested too deeply")) from None
    except ValueError as error:
        raise malformed(violation("", f"the body is not JSON: {error}")) from None
    if not isinstance(value, dict):
        raise malformed(violation("", f"the body is {type(value).__name__}, must be an object"))
    return value


def _refuse_constant(name: str) -> Any:
    raise _NotStrict(f"holds {name}, which is no JSON value")


def _finite(digits: str) -> float:
    number = float(digits)
    if math.isinf(number):
        raise _NotStrict(f"holds {digits[:40]}: a JSON number goes to about 1.8e308 here")
    return number


def _whole(digits: str) -> int:
    if len(digits) > MAX_WHOLE:
        shown = f"{digits[:40]}... ({len(digits)} digits)"
        raise _NotStrict(f"holds {shown}, which is too large: a whole JSON number must fit into 64 bits here")
    return int(digits)


def _object(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    value = dict(pairs)
    if len(value) != len(pairs):
        twice = sorted(name for name, times in Counter(name for name, _ in pairs).items() if times > 1)
        raise _NotStrict(f"gives {', '.join(map(repr, twice))} twice in one object")
    return value


def unknown_fields(body: dict[str, Any], known: Iterable[str]) -> list[Any]:
    """Return a violation for every field of ``body`` that is not known."""
    names = set(known)
    hints = Hints(names)
    return [
        violation(name, f"there is no such field; {hints.instead_of(name)}")
        for name in sorted(body.keys() - names)[: MAX_TOLD + 1]
    ]


def told(error: BadMessage, field: str = "", *, change: int | None = None) -> Any:
    """Return a schema error as a violation."""
    where = ".".join(filter(None, (field, *error.where)))
    return violation(where, error.why, change=change)
