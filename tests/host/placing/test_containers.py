"""The containers: all that they are made of is there, what they run is right, and an engine runs it if there is one."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
import time
import urllib.request
from collections.abc import Iterator
from typing import Any

import pytest
import typer
import yaml

from tests.cli.app import whole
from tests.support.paths import ROOT

COMPOSE = ROOT / "docker" / "compose.yaml"
DOCKERFILE = ROOT / "docker" / "Dockerfile"
SERVICE_FIELDS = {
    "image",
    "build",
    "command",
    "depends_on",
    "entrypoint",
    "hostname",
    "init",
    "network_mode",
    "ports",
    "restart",
    "shm_size",
    "volumes",
}
BUILD_TIMEOUT, UP_TIMEOUT = 1200.0, 120.0
COMPOSES = (("docker", "compose"), ("podman", "compose"), ("podman-compose",))
OLDEST_PODMAN_COMPOSE = (1, 3)
"""Those before it know no ``network_mode``, or have not been tried."""


def _services() -> dict[str, dict[str, Any]]:
    services: dict[str, dict[str, Any]] = yaml.safe_load(COMPOSE.read_text())["services"]
    return services


def test_what_the_image_is_made_of_is_there() -> None:
    copied = [line.split()[1:-1] for line in DOCKERFILE.read_text().splitlines() if line.startswith("COPY ")]
    ignored = (ROOT / "docker" / "Dockerfile.dockerignore").read_text().splitlines()
    taken = {line.removeprefix("!") for line in ignored if line.startswith("!")}
    for name in (name for names in copied for name in names):
        assert (ROOT / name).exists()
        assert name in taken
    packages = {path.parent.name for path in ROOT.glob("*/__init__.py")} - {"tests", "benchmarks"}
    assert packages <= {name for names in copied for name in names}


@pytest.mark.parametrize("name", sorted(_services()))
def test_every_service_is_well_formed_and_its_command_exists(name: str) -> None:
    service = _services()[name]
    assert service.keys() <= SERVICE_FIELDS
    assert set(service.get("depends_on", {})) <= _services().keys()
    command: Any = typer.main.get_command(whole())
    word, *arguments = service["command"]
    options = {option for parameter in command.commands[word].params for option in parameter.opts}
    assert {argument for argument in arguments if argument.startswith("--")} <= options


def test_the_hosts_have_the_names_that_components_are_placed_on_and_certificates_are_made_for() -> None:
    services = _services()
    robot = services["robot"]["command"]
    placed = {robot[i + 1].partition("=")[2] for i, word in enumerate(robot) if word == "--place"}
    joining = [service["command"] for service in services.values() if "--join" in service["command"]]
    names = {command[command.index("--name") + 1] for command in joining}
    assert placed == names
    assert names | {"local"} <= set(services["robot"]["entrypoint"][2].split())


# --- with an engine ---


def _engine() -> list[str] | str:
    """Return the command that runs compose files, or why there is none."""
    why = []
    for compose in COMPOSES:
        problem = _problem(compose)
        if not problem:
            return [*compose, "--file", str(COMPOSE)]
        why.append(problem)
    return "; ".join(dict.fromkeys(why))


def _problem(compose: tuple[str, ...]) -> str:
    """Return why a command does not run compose files, empty if it does."""
    engine = compose[0].removesuffix("-compose")
    for program in (engine, compose[0]):
        if shutil.which(program) is None:
            return f"{program} is not installed"
    said = ""
    for words in ([engine, "info"], [*compose, "version"]):
        done = subprocess.run(words, capture_output=True, text=True, timeout=30, check=False)
        said = (done.stderr + done.stdout).strip() or "no reason given"
        if done.returncode:
            return f"'{' '.join(words)}' fails: {said.splitlines()[0]}"
    version = re.search(r"podman-composer? version\D*(\d+)\.(\d+)", said)
    if version and tuple(map(int, version.groups())) < OLDEST_PODMAN_COMPOSE:
        return f"podman-compose {'.'.join(version.groups())} is older than {'.'.join(map(str, OLDEST_PODMAN_COMPOSE))}"
    return ""


@pytest.fixture
def compose() -> Iterator[list[str]]:
    """Run the containers until the test has ended."""
    engine = _engine()
    if isinstance(engine, str):
        pytest.skip(f"no container engine: {engine}")
    try:
        subprocess.run([*engine, "up", "--build", "--detach"], check=True, timeout=BUILD_TIMEOUT)
        yield engine
    finally:
        subprocess.run([*engine, "down", "--volumes"], check=True, timeout=120)


def _regraft(compose: list[str], *arguments: str) -> Any:
    command = [*compose, "exec", "-T", "robot", "regraft", *arguments, "--json"]
    done = subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)
    return json.loads(done.stdout) if done.returncode == 0 else None


def _wait_on(compose: list[str], **places: str) -> None:
    """Wait until components are active on these hosts, and all others on theirs."""
    deadline = time.monotonic() + UP_TIMEOUT
    found: dict[str, Any] = {}
    while time.monotonic() < deadline:
        shown = _regraft(compose, "ps")
        components = shown["systems"][0]["components"] if shown and shown["systems"] else []
        found = {c["name"]: (c["host"], c["state"], c["alive"]) for c in components}
        wanted = {name: (places.get(name, host), "active", True) for name, (host, _, _) in found.items()}
        if found == wanted and places.keys() <= found.keys():
            return
    raise AssertionError(f"not everything is active on its host: {found}")


def _mission() -> str:
    with urllib.request.urlopen("http://127.0.0.1:8000/api/v1/mission", timeout=10) as answer:
        return str(json.load(answer)["state"])


@pytest.mark.evidence
@pytest.mark.timeout(1800)
def test_the_detector_moves_between_containers_while_the_mission_goes_on(compose: list[str]) -> None:
    _wait_on(compose, gateway="desk", detector="edge")
    assert _mission() == "running"
    for host in ("local", "edge"):
        body = json.dumps({"changes": [{"change": "move", "component": "detector", "host": host}]})
        subprocess.run([*compose, "exec", "-T", "robot", "regraft", "adapt", "-"], input=body, text=True, check=True)
        _wait_on(compose, gateway="desk", detector=host)
        assert _mission() == "running"
