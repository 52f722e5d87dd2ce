"""A small system with the real adaptation manager behind the real gateway, for the tests of a file."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import httpx

from regraft.bus_schema.model.architecture import Architecture
from regraft.component.component import class_path
from regraft.dashboard_api.gateway import Gateway
from regraft.runtime.core.assignment import Assignment
from tests.adaptation.system import SYSTEM, System, in_thread, started
from tests.gateway.conftest import GATEWAY
from tests.gateway.http.contract import Contract
from tests.support.systems import home
from tests.support.waiting import PATIENCE, wait_until


@contextmanager
def served(architecture: Architecture, folder: Path) -> Iterator[tuple[System, httpx.Client]]:
    """Run an architecture with its manager and a gateway; the client checks every answer against the API's document."""
    with home(folder), started(architecture, folder) as system:
        system.start_manager("adaptation_manager")
        assignment = Assignment(SYSTEM, "gateway", class_path(Gateway), parameters=GATEWAY)
        gateway = system.running["gateway"] = in_thread(system.hub, Gateway, assignment)
        wait_until(lambda: gateway.runtime.reporter.status.values.get("url"), "the gateway's URL")
        url = str(gateway.runtime.reporter.status.values["url"])
        with httpx.Client(base_url=url, timeout=PATIENCE) as http:
            http.event_hooks["response"] = [Contract(http.get("/openapi.json").json()).check]
            yield system, http
