"""Requests that the OpenAPI document allows, generated from it, and what the gateway makes of them."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

import httpx
import requests
import schemathesis
from hypothesis import HealthCheck, given, seed, settings
from schemathesis.core.result import Ok

WHOLE = range(-(2**63), 2**64)
MALFORMED = "urn:regraft:problem:malformed"


@dataclass
class Seen:
    """The answers of one operation; ``wrong`` has requests that fit the document and were not treated so."""

    operation: str
    statuses: Counter[int] = field(default_factory=Counter)
    wrong: list[str] = field(default_factory=list)


def as_written(plain: Any) -> Any:
    """Return JSON as others write it, to whom 1.0 and 1 are one number: whole numbers without a fraction."""
    if isinstance(plain, dict):
        return {key: as_written(value) for key, value in plain.items()}
    if isinstance(plain, list):
        return [as_written(value) for value in plain]
    if isinstance(plain, float) and plain.is_integer() and int(plain) in WHOLE:
        return int(plain)
    return float(plain) if isinstance(plain, int) and plain not in WHOLE else plain


def attacked(url: str, names: list[str], examples: int, number: int) -> Iterator[Seen]:
    """Send generated requests to every operation of a gateway; ``names`` are components that there are."""
    document = httpx.get(f"{url}/api/v1/openapi.json").json()
    for found in schemathesis.openapi.from_dict(document).get_all_operations():
        assert isinstance(found, Ok), found
        yield _attacked(found.ok(), url, names, examples, number)


def _attacked(operation: Any, url: str, names: list[str], examples: int, number: int) -> Seen:
    seen = Seen(f"{operation.method.upper()} {operation.path}")

    @seed(number)
    @given(case=operation.as_strategy())
    @settings(max_examples=examples, deadline=None, database=None, suppress_health_check=list(HealthCheck))
    def send(case: Any) -> None:
        if "name" in (case.path_parameters or {}) and len(seen.wrong) + seen.statuses.total() > 2:
            case.path_parameters["name"] = names[seen.statuses.total() % len(names)]
        if isinstance(case.body, dict):
            case.body = as_written(case.body)
            if case.headers and "if-match" in case.headers:
                case.body.pop("revision", None)  # both are allowed, if they are the same
        with _answer(case, url) as answer:
            _note(seen, case, answer)

    send()
    return seen


def _answer(case: Any, url: str) -> requests.Response:
    """Send a request; what the answer holds is read only when it is looked at."""
    return requests.request(**case.as_transport_kwargs(base_url=url), timeout=30.0, stream=True)


def _note(seen: Seen, case: Any, answer: Any) -> None:
    seen.statuses[answer.status_code] += 1
    failed = answer.status_code >= 500 and answer.status_code != 503
    if failed or (answer.status_code == 422 and _is_malformed(answer.json())):
        seen.wrong.append(
            f"{answer.status_code} {answer.text[:700]} for {case.body!r:.700} {case.query} {case.headers}"
        )


def _is_malformed(problem: dict[str, Any]) -> bool:
    """Tell whether a request does not have the right form for anybody: what names a component depends on that one."""
    violations = problem["violations"]
    return problem["type"] == MALFORMED and not (violations and all(one["component"] for one in violations))
