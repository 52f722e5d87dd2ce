"""Robots of somebody else's package on a host that has the package in another folder."""

from __future__ import annotations

import os
import shutil
from collections.abc import Iterator
from pathlib import Path

import pytest

from regraft import run_directory
from regraft.bus_schema.model.adaptation import AdaptationReport, AdaptationRequest, Move, Outcome
from regraft.client import Client
from tests.outside.installing import having, installed_package, started
from tests.support.commands import Command
from tests.support.systems import home
from tests.support.waiting import PATIENCE, wait_until

pytestmark = pytest.mark.slow

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


@pytest.fixture(scope="module")
def installed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the folder in which the first host has the package."""
    return installed_package(PACKAGE, tmp_path_factory)


@pytest.fixture
def elsewhere(installed: Path, tmp_path: Path) -> Path:
    """Return the folder in which the other host has the package."""
    return shutil.copytree(installed, tmp_path / "installed")


@pytest.fixture(scope="module")
def yard(installed: Path, tmp_path_factory: pytest.TempPathFactory) -> Iterator[run_directory.RunInfo]:
    """Run the stack on the first host, which waits for the other."""
    folder = tmp_path_factory.mktemp("yard")
    stack = folder / "stack.yaml"
    stack.write_text(STACK.format(installed=installed))
    with home(folder / "home"):
        words = ("up", str(stack), "--headless", "--system", "tests")
        command = started(having(installed, folder / "home"), *words, log=folder / "up.log")
        try:
            wait_until(lambda: command.process.poll() is not None or run_directory.running(), "the stack to be up")
            command.must_run()
            yield run_directory.find("tests")
        finally:
            command.end()


def joining(installed: Path, yard: run_directory.RunInfo, tmp_path: Path) -> Command:
    """Start the other host."""
    words = ("host", "--join", yard.join, "--name", "edge")
    environment = having(installed, Path(os.environ["REGRAFT_HOME"]))
    return started(environment, *words, log=tmp_path / "edge.log", cwd=tmp_path)


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


def test_a_missing_file_of_a_robot_is_reported_by_the_host_that_lacks_it(
    elsewhere: Path, yard: run_directory.RunInfo, tmp_path: Path
) -> None:
    missing = elsewhere / "acme_rover" / "rover" / "rover.xml"
    missing.unlink()
    edge = joining(elsewhere, yard, tmp_path)
    assert edge.ended() == 2
    assert f"host 'edge': eye.robots.0.model: '{missing}': there is no such file" in edge.log.read_text()


def test_the_files_of_an_installed_robot_are_those_of_the_host_that_reads_them_also_after_a_move(
    installed: Path, elsewhere: Path, yard: run_directory.RunInfo, tmp_path: Path
) -> None:
    edge = joining(elsewhere, yard, tmp_path)
    client = Client.connect(yard)
    try:
        wait_until(lambda: edge.process.poll() is not None or runs(client, "eye"), "the eye to be there")
        edge.must_run()
        assert files(client) == files_in(elsewhere)
        wait_until(lambda: runs(client, "adaptation_manager"), "the adaptation manager to be there")
        for host, there in (("local", installed), ("edge", elsewhere)):
            request = AdaptationRequest((Move("eye", host),))
            report = client.call("adaptation_manager/adapt", request, AdaptationReport, PATIENCE)
            assert report.outcome is Outcome.APPLIED, report
            assert files(client) == files_in(there)
    finally:
        client.close()
        assert edge.end() == 0
