"""The HTTP server, on a thread of its own: the only place where asyncio lives."""

from __future__ import annotations

import asyncio
import ipaddress
import math
import socket
import threading
import time
from typing import Any

import anyio.to_thread
import uvicorn

from regraft.dashboard_api.http.client_connection import KnownConnection
from regraft.patience import Patience, stretched

START_TIMEOUT = 5.0
GRACE = 1
"""Seconds that open requests get to finish when the server stops, more on a crowded machine."""
STOP_TIMEOUT = 3.0
POLL = 0.005
BACKLOG = 128
THREADS = 96
"""Requests that hold a thread at a time. Of them 64 may wait: for outcomes, ends, proposals, objectives."""


class CannotServe(Exception):
    """The address cannot be served at; the text states why and what would be right."""


def bind(address: str, port: int) -> socket.socket:
    """Return a socket bound to a loopback address; port 0 takes any that is free.

    Raises:
        CannotServe: the address is none, or not of this machine's loopback, or the port is taken.
    """
    try:
        family, _, _, _, resolved = socket.getaddrinfo(address, port, type=socket.SOCK_STREAM)[0]
    except OSError as error:
        raise CannotServe(f"cannot serve at {address!r}: {error.strerror or error}") from None
    except UnicodeError:
        # The resolver encodes names first: one with an empty part, or one of over 63 characters, it cannot.
        raise CannotServe(f"cannot serve at {address!r}: this is no name of a host; use 127.0.0.1") from None
    if not ipaddress.ip_address(str(resolved[0]).partition("%")[0]).is_loopback:
        raise CannotServe(
            f"cannot serve at {address!r}: plain HTTP would show access tokens to the network; use 127.0.0.1, and "
            "ssh -L to reach it from elsewhere"
        )
    # Only where the protocol is stated does asyncio turn Nagle's algorithm off, which costs 40 ms per answer.
    bound = socket.socket(family, socket.SOCK_STREAM, socket.IPPROTO_TCP)
    try:
        bound.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        bound.bind(resolved)
        bound.listen(BACKLOG)
    except OSError as error:
        bound.close()
        raise CannotServe(
            f"cannot serve at {address} port {port}: {error.strerror}; "
            "give the gateway another port, or 0 for any that is free"
        ) from None
    return bound


class HttpServer:
    """Serves an ASGI application until it is stopped."""

    def __init__(self, app: Any, bound: socket.socket) -> None:
        """Serve ``app`` at a bound socket, which is closed in the end."""
        self._bound = bound
        host, self.port = bound.getsockname()[:2]
        self.address = f"[{host}]" if ":" in host else host
        config = uvicorn.Config(
            app,
            http=KnownConnection,
            ws="none",
            # A client could claim by X-Forwarded-For to be another one.
            proxy_headers=False,
            loop="asyncio",
            lifespan="off",
            log_config=None,
            access_log=False,
            server_header=False,
            backlog=BACKLOG,
            timeout_graceful_shutdown=GRACE,
        )
        self._server = uvicorn.Server(config)
        self._thread = threading.Thread(target=self._serve, name="http server", daemon=True)
        self._loop: asyncio.AbstractEventLoop | None = None

    @property
    def url(self) -> str:
        """Where it is reached, without a path."""
        return f"http://{self.address}:{self.port}"

    @property
    def running(self) -> bool:
        """Whether it is being served."""
        return self._thread.is_alive()

    def start(self) -> None:
        """Serve from now on; raises CannotServe."""
        self._thread.start()
        within = Patience(START_TIMEOUT)
        while not self._server.started:
            if not self._thread.is_alive() or within.is_over():
                self.stop()
                raise CannotServe(f"the HTTP server at {self.url} did not start; the log says more")
            time.sleep(POLL)

    def stop(self) -> bool:
        """Stop within bounds; returns whether it ended. Requests under way get a moment to finish."""
        self._server.config.timeout_graceful_shutdown = math.ceil(stretched(GRACE))
        within = stretched(STOP_TIMEOUT)
        self._server.should_exit = True
        self._thread.join(within)
        if self._thread.is_alive():
            self._server.force_exit = True
            self._thread.join(within)
        self._bound.close()
        return not self._thread.is_alive()

    @property
    def connections(self) -> frozenset[Any]:
        """The connections of now."""
        return frozenset(self._server.server_state.connections)

    def turns(self, within: float) -> bool:
        """Wait until the event loop has come round, at most ``within`` seconds; returns whether it has."""
        turned = threading.Event()
        if self._loop is None or self._loop.is_closed():
            return False
        try:
            self._loop.call_soon_threadsafe(turned.set)
        except RuntimeError:  # it has just been closed
            return False
        return turned.wait(within)

    def _serve(self) -> None:
        asyncio.run(self._run())

    async def _run(self) -> None:
        self._loop = asyncio.get_running_loop()
        anyio.to_thread.current_default_thread_limiter().total_tokens = THREADS
        await self._server.serve(sockets=[self._bound])
