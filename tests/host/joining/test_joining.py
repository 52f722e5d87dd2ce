"""What several hosts of one system promise, tried on real processes joined by real links."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path

import pytest
from typer.testing import CliRunner

from regraft.bus_schema.messages.protocol.host import ProcessState
from regraft.bus_schema.model.adaptation import Add, Outcome
from regraft.bus_schema.model.architecture import ComponentSpec, TopicSpec
from regraft.bus_schema.model.hosts.host_state import HostState
from tests.cli.app import whole
from tests.host.several import Site
from tests.support.commands import run
from tests.support.hosts import state_of, wait_state
from tests.support.machine.processes import children_of, wait_gone
from tests.support.paths import ROOT
from tests.support.systems import home
from tests.support.waiting import PATIENCE, wait_until

pytestmark = pytest.mark.slow

# --- joining ---


def test_components_of_a_host_that_has_not_joined_wait_and_start_when_it_does(site: Site) -> None:
    system = site.up()
    wait_until(lambda: "ticker" in system.client.components(), "the ticker to be known")
    waiting = system.client.components()["ticker"]
    assert waiting.process is not None
    assert (waiting.host, waiting.process.state, waiting.process.exit_reason) == (
        "edge",
        ProcessState.WAITING,
        "its host has not joined",
    )
    assert state_of(system, "edge") is HostState.ABSENT
    guest = site.join()
    site.wait_active("ticker")
    assert site.pid("ticker") in children_of(guest.process.pid)
    assert system.said("host.joined", "edge")
    wait_until(lambda: "all 2 components active" in system.log.read_text(), "the start to be complete")
    assert any("ticker begins at 0" in line for line in system.client.logs("ticker"))


def test_a_host_that_leaves_takes_its_components_along_in_order_and_another_may_take_its_place(site: Site) -> None:
    system = site.up()
    guest = site.join()
    first = site.wait_active("ticker")
    wait_until(lambda: site.snapshot("ticker")["count"] > 20, "some ticks")
    count, pids = site.snapshot("ticker")["count"], children_of(guest.process.pid)
    assert guest.end() == 0
    wait_gone(pids)
    wait_state(system, "edge", HostState.LEFT)
    assert system.said("host.left", "edge")
    assert not system.said("host.lost", "edge")
    site.join()
    assert site.wait_active("ticker", first) > first
    assert site.snapshot("ticker")["count"] > count - 10, "it goes on from its last checkpoint"


def test_the_end_of_the_system_is_the_end_of_its_hosts(site: Site) -> None:
    system = site.up()
    guest = site.join()
    site.wait_active("ticker")
    pids = children_of(guest.process.pid)
    assert system.end() == 0
    assert guest.process.wait(PATIENCE) == 0
    assert "the system ends" in guest.log.read_text()
    wait_gone(pids)


# --- adapting over hosts ---


def test_what_is_added_to_another_host_runs_there_and_values_set_there_outlive_it(site: Site) -> None:
    site.up()
    guest = site.join()
    first = site.wait_active("ticker")
    second = ComponentSpec(cls="tests.host.parts:Ticker", host="edge", connections={"ticks": "more"})
    assert site.adapt(Add("second", second, (TopicSpec("more", "host_tests/Tick"),))).outcome is Outcome.APPLIED
    assert site.pid("second") in children_of(guest.process.pid)
    assert run("param", "set", "ticker", "step", "7").returncode == 0
    guest.process.kill()
    wait_state(site.system, "edge", HostState.LOST)
    site.join()
    site.wait_active("ticker", first)
    assert site.system.client.view("ticker").parameters["step"] == 7
    assert site.wait_active("second")


def test_a_host_that_the_stack_does_not_name_can_join_and_be_used(site: Site) -> None:
    site.up()
    refused = site.adapt(Add("second", ComponentSpec(cls="tests.host.parts:Moody", host="helper")))
    assert refused.outcome is Outcome.REJECTED
    assert "there is no host 'helper'" in refused.violations[0].problem
    absent = site.adapt(Add("second", ComponentSpec(cls="tests.host.parts:Moody", host="arm")))
    assert "host 'arm' has not joined" in absent.violations[0].problem
    guest = site.join("helper")
    report = site.adapt(Add("second", ComponentSpec(cls="tests.host.parts:Moody", host="helper")))
    assert report.outcome is Outcome.APPLIED, report
    assert site.pid("second") in children_of(guest.process.pid)


def test_a_class_of_a_robots_folder_runs_on_a_host_that_joins(site: Site, tmp_path: Path) -> None:
    rover = tmp_path / "rover"
    rover.mkdir()
    (rover / "rover_parts.py").write_text(HERE)
    (rover / "robot.yaml").write_text(
        "model: robot.yaml\n"
        "components: {here: {class: 'rover_parts:Here', host: edge, parameters: {file: words.txt}}}\n"
    )
    (rover / "words.txt").write_text("those of the robot")
    system = site.up(f"robots: {{scout: {rover}}}\n")
    site.join()
    site.wait_active("scout.here")
    assert any("it has read those of the robot" in line for line in system.client.logs("scout.here"))
    file = {"file": str(rover / "words.txt")}
    report = site.adapt(Add("scout.more", ComponentSpec(cls="rover_parts:Here", host="edge", parameters=file)))
    assert report.outcome is Outcome.APPLIED, report


def test_a_thousand_messages_a_second_cross_three_hubs_in_order_and_without_loss(site: Site) -> None:
    pulse = "  pulse: {class: 'tests.host.parts:Pulse', host: edge}\n"
    site.up(pulse + "  listener: {class: 'tests.host.parts:Listener', host: arm}\n")
    site.join("arm")
    site.wait_active("listener")
    site.join("edge")
    site.wait_active("pulse")
    wait_until(lambda: site.snapshot("listener")["heard"] > 1000, "a thousand pulses")
    assert site.snapshot("listener")["wrong"] == 0
    status = site.system.client.components()["listener"].status
    assert status is not None
    assert status.lost == 0


# --- what does not join ---


@pytest.fixture(scope="module")
def joined(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Site]:
    """Return a site whose host edge has joined, for all those who cannot."""
    folder = tmp_path_factory.mktemp("joined")
    with home(folder / "home"):
        made = Site(folder)
        made.up()
        made.join()
        yield made
        made.close()


@pytest.mark.parametrize(
    ("arguments", "code", "text"),
    [
        (("--join", "ENDPOINT", "--name", "local"), 2, "is the name of a system's first host"),
        (("--join", "ENDPOINT", "--name", "two words"), 2, "cannot name a host"),
        (("--join", "ENDPOINT", "--name", "edge"), 2, "a host 'edge' has joined already"),
        (("--join", "ENDPOINT", "--name", "arm", "--system", "other"), 3, "no system named 'other'"),
        (("--join", "tcp/127.0.0.1:9", "--name", "arm"), 3, "cannot reach tcp/127.0.0.1:9"),
    ],
)
def test_who_cannot_join_is_told_why(joined: Site, arguments: tuple[str, ...], code: int, text: str) -> None:
    command = [word.replace("ENDPOINT", joined.system.info.endpoint) for word in arguments]
    done = run("host", *command)
    assert text in done.stderr
    assert done.returncode == code


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        (("--join", "tcp/127.0.0.1:9"), "--join needs a --name"),
        (("--name", "arm"), "belong to --join"),
        (("--join", "nonsense", "--name", "arm"), "is no endpoint"),
    ],
)
def test_what_is_mistyped_is_told_before_anything_is_joined(arguments: tuple[str, ...], text: str) -> None:
    done = CliRunner().invoke(whole(), ["host", *arguments])
    assert text in done.stderr
    assert done.exit_code == 2


HERE = """
import os, signal
from regraft import Component, Parameter

class Here(Component):
    file = Parameter("", "any file of the stack", unit="path", exists=True)

    def on_configure(self):
        with open(self.file) as file:
            print("it has read", file.read())
"""
ENDING = "import os; os._exit(0)"
INTERRUPTING = "os.register_at_fork(after_in_parent=lambda: os.kill(os.getpid(), signal.SIGINT))"


@pytest.fixture(scope="module")
def waiting(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Site]:
    """Return a site that waits for its host edge, which is to run a class of the stack's folder."""
    folder = tmp_path_factory.mktemp("waiting")
    (folder / "here.py").write_text(HERE)
    (folder / "words.txt").write_text("those of the first host")
    with home(folder / "home"):
        made = Site(folder)
        made.up("  here: {class: 'here:Here', host: edge, parameters: {file: words.txt}}\n")
        yield made
        made.close()


def test_a_class_that_the_other_machine_has_not_got_is_said_when_it_joins(waiting: Site, tmp_path: Path) -> None:
    guest = waiting.begin("edge", "", "--stack-folder", str(tmp_path))
    assert guest.process.wait(PATIENCE) == 2
    assert "cannot import 'here'" in guest.log.read_text()


def test_a_class_whose_import_ends_the_process_is_said_when_its_host_joins(waiting: Site, tmp_path: Path) -> None:
    (tmp_path / "here.py").write_text(ENDING)
    guest = waiting.begin("edge", "", "--stack-folder", str(tmp_path))
    assert guest.process.wait(PATIENCE) == 2
    assert "'here:Here': importing 'here' ends the process: exit code 0" in guest.log.read_text()


def test_a_host_that_is_interrupted_before_it_has_joined_leaves_nothing(waiting: Site, tmp_path: Path) -> None:
    (tmp_path / "here.py").write_text(HERE + INTERRUPTING)
    (tmp_path / "words.txt").touch()
    guest = waiting.begin("edge", "", "--stack-folder", str(tmp_path))
    assert guest.process.wait(PATIENCE) == 130, guest.log.read_text()
    assert not waiting.system.said("host.joined", "edge")
    joined = waiting.join()
    waiting.wait_active("here")
    assert joined.end() == 0


def test_a_relative_stack_folder_is_below_the_folder_in_which_the_command_was_typed(
    waiting: Site, tmp_path: Path
) -> None:
    (tmp_path / "here.py").write_text(HERE)
    (tmp_path / "words.txt").write_text("those of the other machine")
    guest = waiting.join("edge", "", "--stack-folder", os.path.relpath(tmp_path, ROOT))
    waiting.wait_active("here")
    assert any("it has read those of the other machine" in line for line in waiting.system.client.logs("here"))
    assert guest.end() == 0
