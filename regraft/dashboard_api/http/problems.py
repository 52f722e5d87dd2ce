"""Every error of the API: a problem (RFC 9457) that names all that was wrong with the request."""

from __future__ import annotations

import logging
import math
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from fastapi import FastAPI, Request
from fastapi.exceptions import RequestValidationError
from fastapi.routing import APIRoute
from starlette.exceptions import HTTPException
from starlette.responses import JSONResponse, Response
from starlette.types import Receive, Scope, Send

from regraft.bus_schema.errors import BadMessage
from regraft.bus_schema.model.adaptation import AdaptationReport, Violation
from regraft.bus_schema.suggestions import Hints
from regraft.dashboard_api.http.bus_types import COMBINATION, MAX_TOLD, Fields, to_json

LOG = logging.getLogger("regraft.gateway")
MEDIA_TYPE = "application/problem+json"
RETRY_AFTER = 1.0
"""Seconds after which a part that is not available may be asked again, where it gives no time itself."""
POLICY_VIOLATION = 1008
"""The code that closes a WebSocket for what it is (RFC 6455)."""


@dataclass(frozen=True, slots=True)
class Kind:
    """A kind of problem: the last part of its type URN, its HTTP status, its title."""

    slug: str
    status: int
    title: str


UNAUTHENTICATED = Kind("unauthenticated", 401, "It is not proven who asks")
FORBIDDEN = Kind("forbidden", 403, "The caller does not have the role for this")
CROSS_ORIGIN = Kind("cross-origin", 403, "Requests from other origins are refused")
NOT_FOUND = Kind("not-found", 404, "There is no such thing")
BAD_METHOD = Kind("method-not-allowed", 405, "This cannot be done to this resource")
REJECTED = Kind("rejected", 409, "The adaptation was rejected: nothing was touched")
ROLLED_BACK = Kind("rolled-back", 409, "The adaptation failed and was undone")
CANCELLED = Kind("cancelled", 409, "The adaptation was cancelled")
CONFLICT = Kind("conflict", 409, "This is not possible now")
STALE = Kind("stale-revision", 412, "The architecture has another revision by now")
TOO_LARGE = Kind("body-too-large", 413, "The body is too large")
BAD_CONTENT_TYPE = Kind("wrong-content-type", 415, "The body must be JSON")
WRONG_HOST = Kind("wrong-host", 421, "This server does not answer for that host")
MALFORMED = Kind("malformed", 422, "The request does not have the right form")
INVALID = Kind("invalid", 422, "What the request holds cannot be used")
KEY_REUSED = Kind("idempotency-key-reused", 422, "The idempotency key belongs to another request")
THROTTLED = Kind("throttled", 429, "Too many adaptations are asked for")
FAILED = Kind("failed", 500, "Something failed inside the system")
STUCK = Kind("stuck", 500, "The adaptation failed and could not be undone")
REFUSED = Kind("refused", 409, "A part of the system refuses this")
NOT_ACTIVE = Kind("not-active", 503, "A part of the system is not active")
STARTING = Kind("starting", 503, "A part of the system has not started yet")
QUEUE_FULL = Kind("queue-full", 503, "Too many requests are waiting already")
BUSY = Kind("busy", 503, "An action pursues as many goals as it can")
UNAVAILABLE = Kind("unavailable", 503, "A part of the system cannot do this now")
NO_ANSWER = Kind("no-answer", 503, "A part of the system does not answer")

TITLES = {
    401: "It is not proven who asks, or the token is unknown, revoked or expired",
    403: "Cross-origin request, or the caller does not have the role for this",
    404: "Not found",
    409: "Rejected, rolled back, cancelled, refused, or not possible now",
    412: "Stale revision",
    413: "Body too large",
    415: "Not JSON",
    421: "Wrong Host header",
    422: "Malformed request, or one that holds what cannot be used",
    429: "Too many adaptations are asked for; try again after Retry-After seconds",
    500: "Internal failure, or an adaptation that is stuck",
    503: "A part of the system cannot do this now, or does not answer; try again after Retry-After seconds",
}


@dataclass(frozen=True, slots=True)
class ProblemDetails:
    """A problem (RFC 9457). ``report`` is the adaptation's line in the journal, where there is one."""

    type: str
    title: str
    status: int
    detail: str
    instance: str
    violations: tuple[Violation, ...] = ()
    report: AdaptationReport | None = None


class Problem(HTTPException):
    """Raise it to answer a request with a problem."""

    def __init__(
        self,
        kind: Kind,
        detail: str,
        violations: Iterable[Violation] = (),
        *,
        report: AdaptationReport | None = None,
        headers: Mapping[str, str] | None = None,
    ) -> None:
        super().__init__(kind.status, detail, headers)
        self.kind = kind
        self.violations = tuple(violations)
        self.report = report

    def response(self, path: str) -> Response:
        """Return the answer to the request for ``path``."""
        kind = self.kind
        details = ProblemDetails(
            f"urn:regraft:problem:{kind.slug}",
            kind.title,
            kind.status,
            _sendable(self.detail),
            _sendable(path),
            self.violations,
            self.report,
        )
        body = to_json(details)
        if self.report is None:
            del body["report"]
        return JSONResponse(body, kind.status, self.headers, MEDIA_TYPE)

    async def refuse(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer a request with the problem; close a WebSocket before it is accepted, which is a 403 to the client."""
        if scope["type"] == "websocket":
            await receive()
            await send({"type": "websocket.close", "code": POLICY_VIOLATION, "reason": self.kind.slug})
        else:
            await self.response(scope["path"])(scope, receive, send)


def _sendable(text: str) -> str:
    """Return ``text`` as it can be put into JSON: what came in a URL may hold anything."""
    return text.encode(errors="replace").decode()[:4000]


def violation(field: str, problem: str, *, change: int | None = None, component: str = "") -> Violation:
    """Return a violation by a field of the request."""
    return Violation(change, _sendable(component), _sendable(field), _sendable(problem))


def told(error: BadMessage) -> Violation:
    """Return what does not fit a type of the bus as a violation."""
    return violation(".".join(error.where), error.why)


SAID_ELSEWHERE = {
    "actor": "is said by the header X-Regraft-Actor",
    "component": "is named by the path",
    "dry_run": "is said by the query",
    "key": "is said by the header Idempotency-Key",
    "wait": "is said by the header Prefer",
}
"""Fields of records that no body has, and what gives them."""


def violations(errors: Sequence[Any], known: Iterable[str]) -> list[Violation]:
    """Return what pydantic found wrong with a request whose body may have the ``known`` fields."""
    hints = Hints(known)
    return [_violation(error, hints) for error in errors[: MAX_TOLD + 1]]


def _violation(error: Any, hints: Hints) -> Violation:
    source, *where = error["loc"]
    problem = error["msg"]
    if error["type"] == "missing":
        problem = "is missing"
    elif error["type"] == "extra_forbidden":
        problem = SAID_ELSEWHERE.get(where[-1]) or f"there is no such field; {hints.instead_of(where[-1])}"
    change = where[1] if where[:1] == ["changes"] and len(where) > 1 else None
    return violation(".".join(map(str, where)) or source, problem, change=change)


def known_fields(route: Any) -> list[str]:
    """Return the names of the fields that the body of a route may have, as far as they are fixed."""
    metadata = route.body_field.field_info.metadata if isinstance(route, APIRoute) and route.body_field else ()
    return [name for fields in metadata if isinstance(fields, Fields) for name in fields.by_name]


def malformed(*violations: Violation) -> Problem:
    """Return the problem of a request that does not have the right form; of many violations it lists the first."""
    return _of_violations(MALFORMED, violations)


def misfit(errors: Sequence[Any], known: Iterable[str]) -> Problem:
    """Return the problem of a request with errors that pydantic found: does it have the wrong form, or no meaning?"""
    kind = INVALID if all(error["type"] == COMBINATION for error in errors) else MALFORMED
    return _of_violations(kind, tuple(violations(errors, known)))


def _of_violations(kind: Kind, violations: tuple[Violation, ...]) -> Problem:
    if len(violations) > MAX_TOLD:
        violations = (*violations[:MAX_TOLD], violation("", "and there are more"))
    lines = "; ".join(f"{v.field}: {v.problem}" if v.field else v.problem for v in violations)
    return Problem(kind, lines, violations)


def retry_after(kind: Kind, seconds: float | None = None) -> dict[str, str]:
    """Return the header with the time after which a request may be sent again: after ``seconds``, and always for a
    503.
    """
    if seconds is None and kind.status == UNAVAILABLE.status:
        seconds = RETRY_AFTER
    return {} if seconds is None else {"Retry-After": str(max(1, math.ceil(seconds)))}


def unavailable(detail: str, kind: Kind = UNAVAILABLE) -> Problem:
    """Return the problem of a part of the system that cannot do something now."""
    return Problem(kind, detail, headers=retry_after(kind))


def throttled(detail: str, seconds: float) -> Problem:
    """Return the problem of a caller that asks too often, and may again after some seconds."""
    return Problem(THROTTLED, detail, headers=retry_after(THROTTLED, seconds))


def not_found(detail: str) -> Problem:
    """Return the problem of something that is not there."""
    return Problem(NOT_FOUND, detail)


def declared(*statuses: int) -> dict[int | str, dict[str, Any]]:
    """Return, for OpenAPI, the problems that a route may answer with."""
    schema = {"$ref": "#/components/schemas/ProblemDetails"}
    return {status: {"description": TITLES[status], "content": {MEDIA_TYPE: {"schema": schema}}} for status in statuses}


def methods_at(document: dict[str, Any], path: str) -> list[str]:
    """Return the methods that a path takes; Starlette knows only those of the first route that fits."""
    paths: dict[str, dict[str, Any]] = document["paths"]
    templates = [template for template in paths if re.fullmatch(re.sub(r"\{[^}]+\}", "[^/]+", template), path)]
    methods = {method.upper() for template in templates for method in paths[template]}
    return sorted(methods | {"HEAD"} if "GET" in methods else methods)


def nothing_at(path: str) -> Problem:
    """Return the problem of a path without a route."""
    return not_found(f"there is nothing at {path}; see /api/v1/openapi.json")


def bad_method(method: str, allowed: Iterable[str]) -> Problem:
    """Return the problem of a method that a path does not take."""
    return Problem(BAD_METHOD, f"{method} is not possible here", headers={"Allow": ", ".join(allowed) or "GET, HEAD"})


def install(app: FastAPI) -> None:
    """Turn every error of an application into a problem."""

    def own(request: Request, error: Exception) -> Response:
        assert isinstance(error, Problem)
        return error.response(request.url.path)

    def invalid(request: Request, error: Exception) -> Response:
        assert isinstance(error, RequestValidationError)
        return misfit(error.errors(), known_fields(request.scope.get("route"))).response(request.url.path)

    def plain(request: Request, error: Exception) -> Response:
        assert isinstance(error, HTTPException)
        path = request.url.path
        if error.status_code == NOT_FOUND.status:
            return nothing_at(path).response(path)
        if error.status_code == BAD_METHOD.status:
            return bad_method(request.method, methods_at(app.openapi(), path)).response(path)
        return Problem(Kind("http", error.status_code, "HTTP error"), str(error.detail)).response(path)

    def unexpected(request: Request, error: Exception) -> Response:
        LOG.error("%s %s failed", request.method, request.url.path, exc_info=error)
        return Problem(FAILED, "the gateway failed; its log says more").response(request.url.path)

    app.add_exception_handler(Problem, own)
    app.add_exception_handler(RequestValidationError, invalid)
    app.add_exception_handler(HTTPException, plain)
    app.add_exception_handler(Exception, unexpected)
