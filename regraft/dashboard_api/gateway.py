"""The gateway as a component: it serves the REST API while it is active."""

from __future__ import annotations

import secrets

from regraft import Component, Parameter, every
from regraft.bus_schema.model.description import Resources
from regraft.client import Client
from regraft.dashboard_api.app import PREFIX, build, forget_functions
from regraft.dashboard_api.backend.event_buffer import EventBuffer
from regraft.dashboard_api.backend.manager import Services
from regraft.dashboard_api.http.authentication import Callers
from regraft.dashboard_api.server import HttpServer, bind
from regraft.run_directory import folder
from regraft.security.tokens import Tokens

TURN_TIMEOUT = 60.0
"""Seconds without a turn of its loop after which a server has failed, unless a host found it hung earlier."""


class Gateway(Component):
    """Shows the system over HTTP and takes adaptations.

    It looks on from outside simulated time, through the component's own session.
    """

    resources = Resources(cpu=0.04, memory=40.0)
    lockstep = False
    exclusive = True  # of its port
    listens_at_port = True
    removal_forbidden = "those who watch and adapt the system over HTTP would be cut off"
    handler_timeout = 8.0

    address = Parameter("127.0.0.1", "a loopback address of this machine", read_only=True)
    port = Parameter(8000, "0 takes any that is free", minimum=0, maximum=65535, read_only=True)
    answer_within = Parameter(3.0, "patience with services that are asked", minimum=0.1, maximum=60.0, unit="s")
    adaptation_within = Parameter(30.0, "patience with an adaptation's outcome", minimum=0.1, maximum=600.0, unit="s")

    def __init__(self) -> None:
        self._callers = Callers(Tokens(folder(self.kit.system)))
        self._client: Client | None = None
        self._services: Services | None = None
        self._buffer: EventBuffer | None = None
        self._server: HttpServer | None = None

    def on_activate(self) -> None:
        """Serve; raises CannotServe where the address is not loopback or the port is taken."""
        bound = bind(self.address, self.port)
        name = f"{self.kit.name}-rest-{secrets.token_hex(4)}"
        self._client = Client(self.kit.bus, self.kit.system, name)
        self._buffer = EventBuffer()
        self._client.events(self._buffer.add)
        self._services = Services(self._client, self.answer_within, self.adaptation_within)
        self._server = HttpServer(build(self._services, self._buffer, self._callers, self.address), bound)
        try:
            self._server.start()
        except Exception:
            self._stop()
            raise
        self.kit.set_status_text(self._server.url + PREFIX, url=self._server.url + PREFIX)
        self.kit.event("gateway.ready", f"serving at {self._server.url}{PREFIX}", url=self._server.url + PREFIX)

    def on_deactivate(self) -> None:
        """Serve no more: readers of events are sent home, waiting requests answered as unavailable."""
        self._stop()
        self.kit.set_status_text("")

    def on_parameters(self, changed: frozenset[str]) -> None:
        """Wait as long as is wanted now."""
        if self._services:
            self._services.answer_within = self.answer_within
            self._services.adaptation_within = self.adaptation_within

    def on_error(self) -> None:
        """Leave nothing behind."""
        self._stop()

    @every(seconds=1.0)
    def check(self) -> None:
        """Find out if the server has ended by itself, and be as hung as it is."""
        if self._server and not self._server.turns(TURN_TIMEOUT):
            why = "hangs" if self._server.running else "has ended by itself"
            self._server = None
            self.kit.set_status_text(f"the HTTP server {why}")
            raise RuntimeError(f"the HTTP server {why}: deactivate and activate the gateway")

    def _stop(self) -> None:
        buffer, client, server = self._buffer, self._client, self._server
        self._buffer = self._client = self._server = self._services = None
        if buffer:
            buffer.close()
        if client:
            client.close()
        if server and not server.stop():
            self.kit.log.error("the HTTP server did not end in time")
        forget_functions()
