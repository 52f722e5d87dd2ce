"""Hosts in stack files: their names, what they offer, and what is done when one is lost."""

from __future__ import annotations

from pathlib import Path

import pytest

from regraft.bus_schema.model.architecture import HostRules
from regraft.stack import StackError, load, with_places

STACK = """\
system: tests
imports: [regraft.bus_schema.messages.geometry, regraft.bus_schema.messages.power, regraft.bus_schema.messages.sensors]
hosts: HOSTS
topics:
  odometry: regraft/Odometry
  light: regraft/LightLevel
components:
  wheels: {command: [wheels], outputs: {odometry: regraft/Odometry}}
  lighting: {class: 'regraft.services.lighting:Lighting', host: edge}
  manager:
    command: [manager]
    services: {adapt: adaptation_manager/adapt}
"""


def _loaded(folder: Path, hosts: str) -> dict[str, HostRules]:
    file = folder / "stack.yaml"
    file.write_text(STACK.replace("HOSTS", hosts))
    return load(file).architecture.host_rules


def _problems(folder: Path, hosts: str) -> str:
    with pytest.raises(StackError) as caught:
        _loaded(folder, hosts)
    return str(caught.value)


def test_hosts_are_names_or_have_rules(tmp_path: Path) -> None:
    assert _loaded(tmp_path, "[edge]") == {}
    assert _loaded(tmp_path, "{edge: {}}") == {"edge": HostRules()}
    assert _loaded(tmp_path, "{edge: {when_lost: wait}}") == {"edge": HostRules()}
    rules = "{edge: {when_lost: {move_to: local}, lost_after: 1.5, cpu: 2, memory: 512}}"
    assert _loaded(tmp_path, rules) == {"edge": HostRules("local", 1.5, 2.0, 512.0)}
    rules = "{edge: {devices: [fpga], amounts: {power: 12, accelerator_area: 0.5}}}"
    amounts = {"power": 12.0, "accelerator_area": 0.5}
    assert _loaded(tmp_path, rules) == {"edge": HostRules(devices=("fpga",), amounts=amounts)}


@pytest.mark.parametrize(
    ("hosts", "text"),
    [
        ("[arm]", "components.lighting.host: there is no host 'edge'"),
        ("{edge: {when_lost: elsewhere}}", "hosts.edge.when_lost: must be 'wait' or a map {move_to: HOST}"),
        ("{edge: {when_lost: {}}}", "hosts.edge.when_lost.move_to: is missing"),
        ("{edge: {when_lost: {move_to: edgy}}}", "there is no host 'edgy'; did you mean 'edge'?"),
        ("{edge: {when_lost: {move_to: edge}}}", "hosts.edge.when_lost.move_to: is the host itself"),
        ("{edge: {lost_after: 0.1}}", "hosts.edge.lost_after: is 0.1, must be at least 0.5"),
        ("{edge: {lost_afer: 1}}", "hosts.edge.lost_afer: there is no such field; did you mean 'lost_after'?"),
        ("{edge: {}, local: {when_lost: wait}}", "hosts.local.when_lost: the system ends with its first host"),
        ("{edge: {memory: 1}}", "hosts.edge.memory: offers 1 MiB, but its components need"),
        ("{edge: {cpu: -1}}", "hosts.edge.cpu"),
        ("{edge: {amounts: 3}}", "hosts.edge.amounts: must be a map"),
        ("{edge: {amounts: {power: -1}}}", "hosts.edge.amounts.power: is -1, must be finite and at least 0"),
        ("{edge: {amounts: {power: much}}}", "hosts.edge.amounts.power: must be a number, is a text"),
        ("{edge: {amounts: {power: .nan}}}", "hosts.edge.amounts.power: must be finite"),
        ("{edge: {amounts: {memory: 3}}}", "hosts.edge.amounts.memory: is a field of its own"),
        ("{edge: {amount: {power: 3}}}", "hosts.edge.amount: there is no such field; did you mean 'amounts'?"),
        ("{edge: {}, two words: {}}", "cannot name a host"),
        ("{edge: {devices: [fpga, a b]}}", "hosts.edge.devices.1: 'a b' cannot name a device: must be 1 to 128"),
        ("{edge: {devices: ['']}}", "hosts.edge.devices.0: must be a text, is empty"),
        ("{edge: {amounts: {a b: 1}}}", "hosts.edge.amounts.a b: 'a b' cannot name an amount"),
    ],
)
def test_what_is_wrong_with_hosts_is_said(tmp_path: Path, hosts: str, text: str) -> None:
    assert text in _problems(tmp_path, hosts)


def test_without_a_manager_elsewhere_nobody_could_move(tmp_path: Path) -> None:
    file = tmp_path / "stack.yaml"
    text = STACK.replace("HOSTS", "{edge: {when_lost: {move_to: local}}}")
    file.write_text(text.replace("command: [manager]", "command: [manager]\n    host: edge"))
    with pytest.raises(StackError, match="needs an adaptation manager on another host"):
        load(file)


def test_the_world_is_on_the_first_host(tmp_path: Path) -> None:
    file = tmp_path / "stack.yaml"
    world = "system: t\nclock: simulated\nhosts: [edge]\ncomponents:\n"
    file.write_text(world + "  s: {class: 'tests.stack.parts:World', host: edge}\n")
    with pytest.raises(StackError, match=r"components\.s\.host: makes simulated time go on"):
        load(file)


def test_components_are_placed_from_the_command_line(tmp_path: Path) -> None:
    file = tmp_path / "stack.yaml"
    file.write_text(STACK.replace("HOSTS", "[edge]"))
    placed = with_places(load(file), ["wheels=arm", "lighting=local"]).architecture
    assert {name: spec.host for name, spec in placed.components.items()} == {
        "wheels": "arm",
        "lighting": "local",
        "manager": "local",
    }
    assert set(placed.hosts) == {"local", "edge", "arm"}
    with pytest.raises(StackError, match="placement weels=arm: there is no component 'weels'; did you mean 'wheels'"):
        with_places(load(file), ["weels=arm"])
    with pytest.raises(StackError, match="must look like 'component=host'"):
        with_places(load(file), ["wheels"])
