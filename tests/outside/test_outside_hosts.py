"""Robots of somebody else's package on a host that has the package in another folder."""

from __future__ import annotations

import subprocess
from collections.abc import Iterator
from pathlib import Path

import pytest

from regraft import run_directory
from regraft.bus_schema.model.adaptation import AdaptationReport, AdaptationRequest, Move, Outcome
from regraft.client import Client
from tests.outside.installing import having, installed_package, started
from tests.support.waiting import PATIENCE, wait_until

PACKAGE = Path(__file__).parent / "robot_package"
STACK = """\
include: [{installed}/acme_rover/yard/stack.yaml]
hosts: [edge]
topics:
  image: {{type: regraft/Image, sensor_stream: true}}
  adaptations: {{type: regraft/AdaptationReport}}
  architecture: {{type: regraft/Architecture}}
components:
  adaptation_manager: {{class: "regraft.adaptation_manager.manager:AdaptationManager"}}
  eye:
    class: regraft.sim_service.camera_component:Camera
    parameters: {{file: $world, robots: $robots, camera: gate, renderer: ray, width: 32, height: 24}}
    host: edge
"""


@pytest.fixture
def installations(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    """Return the folders in which two hosts have the package."""
    return installed_package(PACKAGE, tmp_path_factory), installed_package(PACKAGE, tmp_path_factory)


@pytest.fixture
def yard(
    installations: tuple[Path, Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> Iterator[run_directory.RunInfo]:
    """Run the stack on the first host, which waits for the other."""
    environment = having(installations[0], tmp_path / "home")
    monkeypatch.setenv("REGRAFT_HOME", environment["REGRAFT_HOME"])
    stack = tmp_path / "stack.yaml"
    stack.write_text(STACK.format(installed=installations[0]))
    process = started(environment, "up", str(stack), "--headless", "--speed", "max", "--system", "tests")
    try:
        wait_until(lambda: process.poll() is not None or run_directory.running(), "the stack to be up")
        yield run_directory.find("tests")
    finally:
        process.terminate()
        process.wait(PATIENCE)


def joining(installed: Path, yard: run_directory.RunInfo, tmp_path: Path) -> subprocess.Popen[bytes]:
    """Start the other host."""
    words = ("host", "--join", yard.join, "--name", "edge")
    return started(having(installed, tmp_path / "home"), *words, cwd=tmp_path)


def runs(client: Client, component: str) -> bool:
    """Return whether a component gives signs of life."""
    seen = client.components().get(component)
    return seen is not None and seen.alive


def files(client: Client) -> set[str]:
    """Return the files that the eye reads."""
    read = client.view("eye", PATIENCE).parameters
    return {read["file"], *(robot["model"] for robot in read["robots"])}


def files_in(installed: Path) -> set[str]:
    """Return the same files of one installation."""
    return {f"{installed}/acme_rover/{file}" for file in ("yard/yard.xml", "rover/rover.xml")}


def test_the_files_of_an_installed_robot_are_those_of_the_host_that_reads_them_also_after_a_move(
    installations: tuple[Path, Path], yard: run_directory.RunInfo, tmp_path: Path
) -> None:
    edge = joining(installations[1], yard, tmp_path)
    client = Client.connect(yard)
    try:
        wait_until(lambda: edge.poll() is not None or runs(client, "eye"), "the eye to be there")
        assert edge.poll() is None
        assert files(client) == files_in(installations[1])
        wait_until(lambda: runs(client, "adaptation_manager"), "the adaptation manager to be there")
        for host, installed in zip(("local", "edge"), installations, strict=True):
            request = AdaptationRequest((Move("eye", host),))
            report = client.call("adaptation_manager/adapt", request, AdaptationReport, PATIENCE)
            assert report.outcome is Outcome.APPLIED, report
            assert files(client) == files_in(installed)
    finally:
        client.close()
        edge.terminate()
        assert edge.wait(PATIENCE) == 0


def test_a_missing_file_of_a_robot_is_reported_by_the_host_that_lacks_it(
    installations: tuple[Path, Path], yard: run_directory.RunInfo, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    missing = installations[1] / "acme_rover" / "rover" / "rover.xml"
    missing.unlink()
    edge = joining(installations[1], yard, tmp_path)
    assert edge.wait(2 * PATIENCE) == 2
    errors = capfd.readouterr().err
    assert f"host 'edge': eye.robots.0.model: '{missing}': there is no such file" in errors
