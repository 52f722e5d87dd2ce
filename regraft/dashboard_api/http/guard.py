"""Runs before the application: no foreign host names, no other origins, no huge bodies; for WebSockets as well.

A browser on this machine can be made to send requests here by any page. A page of another origin shows
by its ``Origin`` or ``Sec-Fetch-Site``. One that rebound its own name to this address shows by its ``Host``.
"""

from __future__ import annotations

import ipaddress
from collections.abc import Awaitable, Callable
from urllib.parse import urlsplit

from starlette.datastructures import Headers, MutableHeaders
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from regraft.dashboard_api.http.problems import CROSS_ORIGIN, TOO_LARGE, WRONG_HOST, Problem

MAX_BODY_SIZE = 1024 * 1024
MAX_DIGITS = 18
SAFE_METHODS = ("GET", "HEAD", "OPTIONS")


class Guard:
    """An ASGI middleware that answers with a problem what must not reach the application."""

    def __init__(self, app: ASGIApp, address: str) -> None:
        """Guard ``app``, which is served at ``address``."""
        self._app = app
        self._address = address

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Handle one request."""
        if scope["type"] == "lifespan":
            await self._app(scope, receive, send)
            return
        if scope["type"] not in ("http", "websocket"):
            raise ValueError(f"a connection of type {scope['type']!r} is not served")
        try:
            headers = Headers(scope=scope)
            self._check_host(headers)
            _check_origin(headers, may_follow_links=scope.get("method") in SAFE_METHODS)
            _check_announced_length(headers)
        except Problem as problem:
            await problem.refuse(scope, receive, _hardened(send))
            return
        await self._app(scope, _bounded(receive), _hardened(send))

    def _check_host(self, headers: Headers) -> None:
        hosts = headers.getlist("host")
        name = _host_name(hosts[0]) if len(hosts) == 1 else None
        if name is None or not (name == self._address.lower() or _is_loopback(name)):
            given = ", ".join(hosts) or "none"
            raise Problem(WRONG_HOST, f"the Host header is {given!r}: must name localhost or {self._address}")


def _host_name(host: str) -> str | None:
    try:
        return urlsplit(f"//{host}").hostname
    except ValueError:
        return None


def _is_loopback(name: str) -> bool:
    if name == "localhost":
        return True
    try:
        return ipaddress.ip_address(name).is_loopback
    except ValueError:
        return False


def _check_origin(headers: Headers, *, may_follow_links: bool) -> None:
    origin = headers.get("origin")
    if origin is not None and _origin_host(origin) != headers["host"].lower():
        raise Problem(CROSS_ORIGIN, f"the request comes from a page of {origin!r}")
    site = headers.get("sec-fetch-site", "none")
    following_a_link = may_follow_links and headers.get("sec-fetch-mode") == "navigate"
    if site not in ("none", "same-origin") and not following_a_link:
        raise Problem(CROSS_ORIGIN, f"the request comes from a {site} page")


def _origin_host(origin: str) -> str | None:
    try:
        return urlsplit(origin).netloc.lower()
    except ValueError:
        return None


def _check_announced_length(headers: Headers) -> None:
    length = headers.get("content-length", "0")
    if length.isdecimal() and (len(length) > MAX_DIGITS or int(length) > MAX_BODY_SIZE):
        raise _too_large()


def _too_large() -> Problem:
    return Problem(TOO_LARGE, f"a body may be at most {MAX_BODY_SIZE} bytes long")


def _bounded(receive: Receive) -> Receive:
    """Return ``receive`` with an end to it: a body need not announce its length."""
    received = 0

    async def bounded() -> Message:
        nonlocal received
        message = await receive()
        received += len(message.get("body", b""))
        if received > MAX_BODY_SIZE:
            raise _too_large()
        return message

    return bounded


def _hardened(send: Send) -> Callable[[Message], Awaitable[None]]:
    async def hardened(message: Message) -> None:
        if message["type"] == "http.response.start":
            headers = MutableHeaders(scope=message)
            headers["cache-control"] = "no-store"
            headers["x-content-type-options"] = "nosniff"
        await send(message)

    return hardened
