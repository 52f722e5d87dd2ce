"""Hosts in network namespaces of their own, running what the containers run: a real cable, pulled and put back."""

from __future__ import annotations

import contextlib
import json
import os
import re
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
import yaml

from tests.support.machine.processes import children_of
from tests.support.paths import ROOT

pytestmark = [pytest.mark.evidence, pytest.mark.alone, pytest.mark.timeout(600)]

COMPOSE = ROOT / "docker" / "compose.yaml"
WITHIN = 120.0
ETC = Path("/etc/netns")
ROBOT, EDGE = "10.77.0.1", "10.77.0.2"


def _ip(*words: str) -> None:
    subprocess.run(["ip", *words], check=True, capture_output=True)


class Machines:
    """Two network namespaces with a cable between them."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.robot, self.edge = f"rgr{os.getpid()}", f"rge{os.getpid()}"
        self.processes: dict[str, subprocess.Popen[bytes]] = {}
        services = yaml.safe_load(COMPOSE.read_text())["services"]
        commands = {name: service["command"] for name, service in services.items()}
        first = re.search(r"regraft (certificates .+?)\s+&&", services["robot"]["entrypoint"][2], re.DOTALL)
        assert first is not None, "the robot makes the certificates before anything else"
        commands["certificates"] = first.group(1).split()
        self.commands = {
            name: [word.replace("/certificates", str(folder / "lab")) for word in command]
            for name, command in commands.items()
        }

    def build(self) -> None:
        """Make the machines and the cable."""
        for name in (self.robot, self.edge):
            _ip("netns", "add", name)
            _ip("-n", name, "link", "set", "lo", "up")
            (ETC / name).mkdir(parents=True)
            (ETC / name / "hosts").write_text(f"127.0.0.1 localhost\n{ROBOT} robot\n")
        _ip("link", "add", "cable", "netns", self.robot, "type", "veth", "peer", "name", "cable", "netns", self.edge)
        for name, address in ((self.robot, ROBOT), (self.edge, EDGE)):
            _ip("-n", name, "address", "add", f"{address}/24", "dev", "cable")
            _ip("-n", name, "link", "set", "cable", "up")

    def cable(self, state: str) -> None:
        """Pull the cable (``down``), or put it back (``up``)."""
        _ip("-n", self.edge, "link", "set", "cable", state)

    def remove(self) -> None:
        """End everything, and leave nothing behind."""
        for process in self.processes.values():
            process.send_signal(signal.SIGINT)
        for process in self.processes.values():
            try:
                process.wait(30)
            except subprocess.TimeoutExpired:
                process.kill()
        for name in (self.robot, self.edge):
            with contextlib.suppress(subprocess.CalledProcessError):
                _ip("netns", "delete", name)
            shutil.rmtree(ETC / name, ignore_errors=True)

    def _environment(self, home: str) -> dict[str, str]:
        return {**os.environ, "REGRAFT_HOME": str(self.folder / home), "PYTHONPATH": str(ROOT)}

    def start(self, service: str, machine: str) -> None:
        """Run a container's command on a machine."""
        command = ["ip", "netns", "exec", machine, sys.executable, "-m", "regraft.cli", *self.commands[service]]
        with (self.folder / f"{service}.log").open("wb") as log:
            self.processes[service] = subprocess.Popen(
                command, cwd=ROOT, env=self._environment(service), stdout=log, stderr=log
            )

    def regraft(self, *arguments: str, text: str = "") -> Any:
        """Return what a command on the robot's machine printed as JSON, None if it failed."""
        command = ["ip", "netns", "exec", self.robot, sys.executable, "-m", "regraft.cli", *arguments, "--json"]
        environment = self._environment("robot")
        done = subprocess.run(
            command, cwd=ROOT, env=environment, input=text, capture_output=True, text=True, check=False
        )
        if done.returncode:
            print(arguments, done.stdout, done.stderr)
        return json.loads(done.stdout) if done.returncode == 0 else None

    def component(self, name: str) -> dict[str, Any]:
        """Return what is seen of a component."""
        shown = self.regraft("ps")
        components = shown["systems"][0]["components"] if shown and shown["systems"] else []
        return next((c for c in components if c["name"] == name), {})

    def wait(self, name: str, **wanted: object) -> dict[str, Any]:
        """Wait until a component is as wanted."""
        deadline = time.monotonic() + WITHIN
        seen: dict[str, Any] = {}
        while time.monotonic() < deadline:
            seen = self.component(name)
            if seen and all(seen[key] == value for key, value in wanted.items()):
                return seen
        logs = "\n".join(path.read_text() for path in self.folder.glob("*.log"))
        raise AssertionError(f"{name} is not {wanted}: {seen}\n{logs}")


@pytest.fixture
def machines(tmp_path: Path) -> Iterator[Machines]:
    """Return two machines."""
    made = Machines(tmp_path)
    try:
        made.build()
    except (OSError, subprocess.CalledProcessError) as error:
        made.remove()
        pytest.skip(f"no network namespaces: {error}")
    yield made
    made.remove()


def _move(machines: Machines, host: str) -> str:
    """Have the detector moved; returns the outcome."""
    body = json.dumps({"changes": [{"change": "move", "component": "detector", "host": host}]})
    outcome: str = machines.regraft("adapt", "-", "--timeout", "60", text=body)["outcome"]
    return outcome


def test_frog_runs_on_three_hosts_loses_one_and_gets_it_back(machines: Machines) -> None:
    certificates = [sys.executable, "-m", "regraft.cli", *machines.commands["certificates"]]
    subprocess.run(certificates, cwd=ROOT, check=True, capture_output=True)
    machines.start("robot", machines.robot)
    machines.wait("detector", process="waiting")
    machines.start("edge", machines.edge)
    machines.start("gateway", machines.robot)  # which shares the robot's network, as the container shares the host's
    machines.wait("gateway", host="desk", state="active")
    first = machines.wait("detector", host="edge", state="active", alive=True)
    assert first["pid"] in children_of(machines.processes["edge"].pid)

    for host in ("local", "edge"):
        assert _move(machines, host) == "applied"
        first = machines.wait("detector", host=host, state="active", alive=True)
        assert machines.regraft("mission", "show")["state"] == "running"

    machines.cable("down")
    machines.wait("detector", process="lost", exit_reason="its host is lost")
    assert _move(machines, "local") == "applied_state_lost"
    second = machines.wait("detector", host="local", state="active", alive=True)
    assert second["incarnation"] > first["incarnation"]
    assert first["pid"] in children_of(machines.processes["edge"].pid), "nobody can tell it yet"

    machines.cable("up")
    deadline = time.monotonic() + WITHIN
    while first["pid"] in children_of(machines.processes["edge"].pid):
        assert time.monotonic() < deadline, "the old run has been ended"
    third = machines.wait("detector", host="local", state="active", alive=True)
    assert third["incarnation"] == second["incarnation"], "whoever acts goes on acting"
    hosts = {host["name"]: host["state"] for host in machines.regraft("host")["hosts"]}
    assert hosts == {"local": "first", "desk": "joined", "edge": "joined"}
