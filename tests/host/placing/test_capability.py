"""Hosts offer amounts and devices: nobody is placed where they lack, and who asks gets what is declared and taken."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from typer.testing import CliRunner

from regraft.bus_schema.model.adaptation import Move, Outcome
from regraft.bus_schema.model.hosts.host_state import HostState
from tests.cli.app import whole
from tests.host.several import STACK, Site
from tests.support.commands import run
from tests.support.hosts import wait_state
from tests.support.waiting import wait_until

pytestmark = pytest.mark.slow

FAST = "  fast: {class: 'tests.host.parts:Fast', host: edge}\n"
THRIFTY = "  thrifty: {class: 'tests.host.parts:Thrifty', host: edge}\n"
EDGE = "edge: {when_lost: {move_to: local}, lost_after: 1.0, devices: [fpga], amounts: {accelerator_area: 1}}"


def test_a_component_that_needs_a_device_does_not_start_on_a_host_without(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("REGRAFT_HOME", str(tmp_path / "home"))
    stack = tmp_path / "stack.yaml"
    stack.write_text(STACK.replace("HOSTS", "{edge: {amounts: {accelerator_area: 1}}}") + FAST)
    for command in (("up", str(stack), "--headless"), ("stack", "check", str(stack))):
        refused = CliRunner().invoke(whole(), command)
        assert refused.exit_code == 2, refused
        assert f"{stack}:13: components.fast: needs fpga for itself, and host 'edge' has none" in refused.stderr
    stack.write_text(STACK.replace("HOSTS", f"{{{EDGE}}}") + FAST)
    placed = CliRunner().invoke(whole(), ["up", str(stack), "--headless", "--place", "fast=local"])
    assert placed.exit_code == 2
    assert "needs 0.5 accelerator_area, and host 'local' offers none" in placed.stderr
    assert "offered by: edge" in placed.stderr


def test_the_rescue_starts_what_has_room_and_says_what_has_none(site: Site) -> None:
    system = site.up(FAST + THRIFTY, f"{{local: {{amounts: {{accelerator_area: 0.6}}}}, {EDGE}}}")
    guest = site.join()
    first = site.wait_active("thrifty")
    site.wait_active("fast")
    guest.process.kill()
    assert site.wait_active("thrifty", first) > first
    assert site.host_of("thrifty") == "local"
    wait_until(lambda: bool(system.said("host.stranded", "edge")), "what has no room to be named")
    (event,) = system.said("host.stranded", "edge")
    assert "fast: rejected" in event.text
    assert "needs fpga for itself, and host 'local' has none" in event.text
    wait_state(system, "edge", HostState.LOST)
    by_hand = site.adapt(Move("fast", "local"))
    assert by_hand.outcome is Outcome.REJECTED
    assert {one.field for one in by_hand.violations} == {"resources.devices", "hosts.local.amounts.accelerator_area"}
    again = site.join()
    again.wait_joined(system)
    site.wait_active("fast")


def test_the_capability_of_each_host_is_shown(site: Site) -> None:
    system = site.up(FAST + THRIFTY, f"{{local: {{cpu: 2}}, {EDGE}}}")
    site.join()
    site.wait_active("fast")
    shown = run("host", "--resources", "--json", "--system", system.info.system)
    assert shown.returncode == 0, shown.stderr
    hosts = {host["host"]: host for host in json.loads(shown.stdout)["hosts"]}
    amounts = {amount["name"]: amount for amount in hosts["edge"]["amounts"]}
    assert (amounts["cpu"]["offered"], amounts["cpu"]["declared"], amounts["cpu"]["unit"]) == (None, 0.2, "cores")
    assert amounts["memory"]["declared"] == 40.0
    assert amounts["memory"]["measured"] > 5.0
    assert 0.0 <= amounts["cpu"]["measured"] < 2.0
    area = amounts["accelerator_area"]
    assert (area["offered"], area["declared"], area["measured"], area["unit"]) == (1.0, 0.75, None, "")
    assert area["why"] == "only declared: the system has no measure of it"
    parts = {part["component"]: part["amounts"] for part in hosts["edge"]["components"]}
    assert set(parts) == {"fast", "thrifty"}
    fast = {amount["name"]: amount for amount in parts["fast"]}
    assert (fast["memory"]["declared"], fast["memory"]["why"]) == (20.0, "")
    assert 1.0 < fast["memory"]["measured"] < amounts["memory"]["measured"]
    assert (fast["accelerator_area"]["declared"], fast["accelerator_area"]["measured"]) == (0.5, None)
    assert hosts["edge"]["devices"] == [{"name": "fpga", "holder": "fast"}]
    assert {amount["name"]: amount["offered"] for amount in hosts["local"]["amounts"]} == {"cpu": 2.0, "memory": None}
    table = run("host", "--resources", "--system", system.info.system).stdout
    assert "fpga" in table
    assert "no limit" in table
    refused = run("host", "--resources", "--join", "tcp/127.0.0.1:1", "--name", "x")
    assert refused.returncode == 2
