from __future__ import annotations

import json
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import httpx
import pytest

from regraft.bus_schema.messages.protocol.control import ParameterValues
from regraft.dashboard_api.backend.event_buffer import EventBuffer
from regraft.dashboard_api.gateway import Gateway
from tests.gateway.http.contract import contract
from tests.gateway.parts import Drive, HostStub, Navigator, ScriptedExecutor, ScriptedManager
from tests.support.stepped.site import Site
from tests.support.systems import home
from tests.support.waiting import PATIENCE, wait_until

GATEWAY = {"port": 0, "answer_within": 10.0, "adaptation_within": 20.0}


def client(url: str) -> httpx.Client:
    """Return a client of a gateway; it reads no certificates, which takes longer than most requests."""
    return httpx.Client(base_url=url, timeout=PATIENCE, verify=False)


@dataclass
class Running:
    """A small robot with its gateway; ``http`` checks every answer against the API's own document."""

    site: Site
    manager: ScriptedManager
    executor: ScriptedExecutor
    host: HostStub
    url: str
    http: httpx.Client

    def post(self, path: str, body: Any = None, **more: Any) -> httpx.Response:
        """Post JSON."""
        return self.http.post(path, json=body, **more)

    def impatient(self) -> None:
        """Let the gateway wait for half a second at the most."""
        values = {"answer_within": 0.5, "adaptation_within": 0.5}
        self.site.client.control("gateway", "parameters", ParameterValues(values))

    def connect(self) -> httpx.Client:
        """Return another client, without checks."""
        return client(self.url)


def start_gateway(site: Site, **parameters: Any) -> str:
    """Start a gateway and return where it serves; all that it has said of its start is behind those who read events."""
    gateway: Any = site.start(Gateway, "gateway", parameters={**GATEWAY, **parameters})
    wait_until(lambda: site.runtimes["gateway"].reporter.status.values.get("url"), "the gateway's URL")
    wait_until(lambda: _has_told_its_start(gateway._buffer), "the events of its start")
    return str(site.runtimes["gateway"].reporter.status.values["url"])


def _has_told_its_start(buffer: EventBuffer) -> bool:
    """Whether a gateway has the last event of its own start, which is that of its activation."""
    kept, _ = buffer.after(0)
    told = [json.loads(each.text) for each in kept if each.kind == "component.transition"]
    return ("gateway", "activate") in [(each["subject"], each["details"]["transition"]) for each in told]


@contextmanager
def empty_site(folder: Path) -> Iterator[Site]:
    """Give a site in a home of its own."""
    with home(folder):
        site = Site("memory")
        yield site
        site.close()


@contextmanager
def small_robot(site: Site) -> Iterator[Running]:
    """Give a small robot with its gateway."""
    manager = site.start(ScriptedManager, "adaptation_manager")
    executor = site.start(ScriptedExecutor, "bt_executor")
    site.start(Navigator, "navigator")
    site.start(Drive, "drive")
    host = HostStub(site.session(), site.keys)
    url = start_gateway(site)
    with client(url) as http:
        http.event_hooks["response"] = [contract(http).check]
        yield Running(site, manager, executor, host, url, http)
    host.close()


@pytest.fixture
def site(tmp_path: Path) -> Iterator[Site]:
    with empty_site(tmp_path / "home") as made:
        yield made


@pytest.fixture
def running(site: Site) -> Iterator[Running]:
    """Return a small robot that the test has for itself."""
    with small_robot(site) as robot:
        yield robot


@pytest.fixture(scope="module")
def shared(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Running]:
    """Return the small robot of a file, for tests that leave it as it was."""
    with empty_site(tmp_path_factory.mktemp("shared") / "home") as site, small_robot(site) as robot:
        yield robot
