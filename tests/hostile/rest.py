"""A system with an adaptation manager and a gateway, asked over REST."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import httpx

from tests.support.machine.ports import free_port
from tests.support.systems import System
from tests.support.waiting import PATIENCE, wait_until

MANAGER = (
    "  adaptation_manager: {class: 'regraft.adaptation_manager.manager:AdaptationManager',"
    " parameters: {journal: $RUN/journal.sqlite}}\n"
)


class Rest:
    """The system, and a client of its gateway."""

    def __init__(self, start: Callable[..., System], components: str) -> None:
        self.port = free_port()
        gateway = f"  gateway: {{class: 'regraft.dashboard_api.gateway:Gateway', parameters: {{port: {self.port}}}}}\n"
        self.system = start(components + MANAGER + gateway)
        self.client = httpx.Client(base_url=f"http://127.0.0.1:{self.port}/api/v1", timeout=PATIENCE, verify=False)
        wait_until(self._ready, "the manager and the gateway")

    def _ready(self) -> bool:
        try:
            return self.client.get("/architecture").status_code == 200
        except httpx.TransportError:
            return False

    def __enter__(self) -> Rest:
        return self

    def __exit__(self, *_: object) -> None:
        self.client.close()

    def get(self, path: str) -> httpx.Response:
        """Ask for something."""
        return self.client.get(path)

    def adapt(self, component: str, parameters: dict[str, Any]) -> httpx.Response:
        """Set parameters of a component."""
        return self.post([{"change": "set_parameters", "component": component, "parameters": parameters}])

    def post(self, changes: list[Any]) -> httpx.Response:
        """Ask for an adaptation."""
        return self.client.post("/adaptations", json={"changes": changes})
