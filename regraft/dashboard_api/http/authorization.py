"""Runs behind the guard: reading passes, acting needs a proven caller with the route's role."""

from __future__ import annotations

import asyncio
import re
from collections.abc import Callable
from typing import Any

from starlette.types import ASGIApp, Receive, Scope, Send

from regraft.dashboard_api.http.authentication import CALLER, Callers
from regraft.dashboard_api.http.problems import FORBIDDEN, Problem, bad_method, methods_at, nothing_at
from regraft.dashboard_api.http.roles import READING_METHODS, ROLES, WEBSOCKET


class Authorization:
    """An ASGI middleware that lets acting requests through to the application by their role alone."""

    def __init__(self, app: ASGIApp, callers: Callers, prefix: str, document: Callable[[], dict[str, Any]]) -> None:
        """Guard ``app``, whose routes begin with ``prefix`` and are described by ``document``."""
        self._app = app
        self._callers = callers
        self._document = document
        self._routes = [
            (method, re.compile(re.escape(prefix) + re.sub(r"\{[^}]+\}", "[^/]+", path)), f"{method} {path}", role)
            for (method, path), role in ROLES.items()
        ]

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Handle one request."""
        method = scope.get("method", WEBSOCKET)
        if scope["type"] != "lifespan" and method not in READING_METHODS:
            try:
                await self._admit(method, scope)
            except Problem as problem:
                await problem.refuse(scope, receive, send)
                return
        await self._app(scope, receive, send)

    async def _admit(self, method: str, scope: Scope) -> None:
        path = scope["path"]
        found = next((r for r in self._routes if r[0] == method and r[1].fullmatch(path)), None)
        if found is None:
            raise self._undeclared(method, path)
        name, role = found[2], found[3]
        if role is not None:
            # The kernel's table may be long: meanwhile others are served.
            caller = await asyncio.to_thread(self._callers.identify, scope, role)
            caller.require(role, name)
            scope[CALLER] = caller

    def _undeclared(self, method: str, path: str) -> Problem:
        """Return why an acting request for which no role is declared is refused."""
        allowed = methods_at(self._document(), path)
        if method in allowed:
            return Problem(
                FORBIDDEN, f"{method} {path}: no role is declared for this route in regraft/dashboard_api/http/roles.py"
            )
        return bad_method(method, allowed) if allowed else nothing_at(path)
