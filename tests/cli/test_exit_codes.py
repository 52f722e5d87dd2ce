"""Errors meant for people are a line of text and an exit code; scripts can tell them apart."""

from __future__ import annotations

import errno
import json
import os
import socket
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest

from regraft import CallFailed, run_directory
from regraft.bus.interface import BusError
from regraft.cli.group import exit_code
from regraft.cli.outcomes import BAD_INPUT, FAILED, NOT_REACHABLE
from regraft.client import ClientError, NoAnswer, NoSuchComponent, NoSuchHost
from regraft.run_directory import RunInfo
from regraft.stack import Problem, StackError
from regraft.system.launch import NoPort
from tests.cli.conftest import Regraft
from tests.cli.live import STACK
from tests.support.waiting import PATIENCE

NEED_A_SYSTEM = [
    ("host",),
    ("events",),
    ("journal",),
    ("undo", "1"),
    ("adapt", "-"),
    ("connect", "a", "b", "c"),
    ("param", "list"),
    ("param", "set", "a", "b", "1"),
    ("param", "set", "--reason", "-1", "a", "b", "-0.5", "--dry-run"),
    ("objective", "report", "a", "-.inf"),
    ("mission", "set", "a", "-.5"),
    ("lifecycle", "get", "a"),
    ("topic", "list"),
    ("topic", "echo", "a"),
    ("service", "call", "a"),
    ("action", "send", "a"),
    ("mission", "status"),
    ("logs", "a"),
    ("down",),
]

LONGER_THAN_A_NAME = "x" * 300
"""The name of a file that no file system takes: looking for it is an error, also for a user who may read all."""


@pytest.mark.parametrize("command", NEED_A_SYSTEM, ids=" ".join)
def test_without_a_running_system_a_command_exits_with_3(regraft: Regraft, command: tuple[str, ...]) -> None:
    found = regraft(*command, text='{"changes": []}')
    assert found.exit_code == NOT_REACHABLE
    assert "regraft up" in found.stderr


def test_an_unknown_system_exits_with_3_and_is_named(regraft: Regraft) -> None:
    before, after = ("--system", "nope", "ps"), ("ps", "--system", "nope")
    for arguments in (before, after, ("down", "nope"), ("down", "--system", "nope")):
        found = regraft(*arguments)
        assert found.exit_code == NOT_REACHABLE
        assert "'nope'" in found.stderr


@pytest.mark.parametrize("command", [("undo", "1"), ("show", "1"), ("diff", "0", "1")], ids=" ".join)
def test_a_system_named_behind_a_group_is_the_one_that_is_meant(
    regraft: Regraft, home: Path, command: tuple[str, ...], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("REGRAFT_SYSTEM", "other")
    with run_directory.lock("other"):
        run_directory.write_info(RunInfo("other", "1", 1, "tcp/127.0.0.1:1", "stack.yaml", False))
        for words in (("--system", "nope", *command), ("--system", "other", *command, "--system", "nope")):
            found = regraft("journal", *words)
            assert (found.exit_code, "'nope'" in found.stderr) == (NOT_REACHABLE, True), found.stderr


def test_nothing_running_is_a_good_answer_of_ps(regraft: Regraft) -> None:
    found = regraft("ps", "--json")
    assert found.exit_code == 0
    assert json.loads(found.stdout) == {"systems": []}


def test_a_system_that_died_is_not_running(regraft: Regraft, home: Path) -> None:
    (home / "dead").mkdir()
    run_directory.write_info(RunInfo("dead", "1", 1, "tcp/127.0.0.1:1", "stack.yaml", False))
    assert json.loads(regraft("ps", "--json").stdout) == {"systems": []}
    assert "dead died without a farewell" in regraft("doctor", "--json").stdout


def test_a_run_of_a_system_continues_until_it_ends_or_another_has_its_name(home: Path) -> None:
    info = RunInfo("one", "1", 1, "tcp/127.0.0.1:1", "stack.yaml", False)
    with run_directory.lock("one"):
        run_directory.write_info(info)
        assert run_directory.continues(info)
        run_directory.write_info(replace(info, run="2"))
        assert not run_directory.continues(info)
        run_directory.write_info(info)
        run_directory.forget_info("one")
        assert run_directory.continues(info), "its processes are about to end"
    assert not run_directory.continues(info)


def test_a_machine_without_a_free_port_is_a_finding_of_the_doctor(
    regraft: Regraft, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(*_: object) -> None:
        raise OSError(errno.EADDRNOTAVAIL, os.strerror(errno.EADDRNOTAVAIL))

    monkeypatch.setattr(socket.socket, "bind", refuse)
    done = regraft("doctor", "--json")
    assert done.exit_code == FAILED, done.output
    findings = json.loads(done.stdout)["findings"]
    problems = {finding["check"]: finding["text"] for finding in findings if finding["level"] == "problem"}
    for check in ("bus", "ports"):
        assert problems[check].endswith("is free: cannot assign requested address")


def test_a_system_that_cannot_be_reached_exits_with_3(regraft: Regraft, home: Path) -> None:
    held = run_directory.lock("deaf")
    run_directory.write_info(RunInfo("deaf", "1", 1, "tcp/127.0.0.1:1", "stack.yaml", False))
    found = regraft("ps")
    held.close()
    assert found.exit_code == NOT_REACHABLE
    assert "deaf cannot be reached" in found.stderr


@pytest.mark.parametrize(
    "arguments",
    [
        ("up",),
        ("up", "nowhere.yaml"),
        ("up", str(STACK), "--speed", "warp"),
        ("up", str(STACK), "--speed", "max"),
        ("up", str(STACK), "--for", "0"),
        ("up", str(STACK), "--seed", "-1"),
        ("up", str(STACK), "--system", "a b"),
        ("up", str(STACK), "--set", "talker.step=11"),
        ("up", str(STACK), "--set", "talker"),
        ("run", "nowhere"),
        ("run", "no.such.module:Class"),
        ("run", "regraft:CallFailed"),
        ("run", "regraft.services.battery:Battery", "--set", "no_such=1"),
        ("run", "regraft.services.battery:Battery", "--set", "nonsense"),
        ("run", "regraft.services.battery:Battery", "--connect", "no_such=topic"),
        ("run", "regraft.services.battery:Battery", "--name", "a b"),
        ("types", "regraft/Twits"),
        ("types", "--import", "no_such_module"),
        ("frobnicate",),
        ("lifecycle", "set", "a", "fly"),
        ("param", "set", "a", "b", "-x"),
        ("journal", "--limit", "0"),
        ("journal", "--limit", "5", "show", "1"),
        ("journal", "--before", "5", "diff", "0", "1"),
    ],
    ids=" ".join,
)
def test_bad_input_exits_with_2_and_says_why(regraft: Regraft, arguments: tuple[str, ...]) -> None:
    found = regraft(*arguments)
    assert found.exit_code == BAD_INPUT
    assert found.stderr
    assert "Traceback" not in found.output


def test_a_stack_with_errors_names_file_and_line_of_every_one(regraft: Regraft, tmp_path: Path) -> None:
    text = (STACK / "stack.yaml").read_text().replace("clitest/Number, rate: 20", "clitest/Nmber, rat: 20")
    (tmp_path / "stack.yaml").write_text(text)
    (tmp_path / "tiny_parts.py").write_text((STACK / "tiny_parts.py").read_text())
    found = regraft("up", str(tmp_path))
    assert found.exit_code == BAD_INPUT
    assert found.stderr.count("stack.yaml:6: ") >= 2


def test_a_request_that_is_no_adaptation_names_the_field(regraft: Regraft, tmp_path: Path) -> None:
    file = tmp_path / "request.yaml"
    file.write_text("changes: [{change: set_parameters, component: a, paramters: {}}]")
    found = regraft("adapt", str(file))
    assert found.exit_code == BAD_INPUT
    assert "parameters" in found.stderr


@pytest.fixture
def port() -> Iterator[int]:
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        yield taken.getsockname()[1]


def test_a_gateway_port_in_use_is_said_before_anything_runs(regraft: Regraft, home: Path, port: int) -> None:
    file = home / "stack.yaml"
    gateway = f"{{class: 'regraft.dashboard_api.gateway:Gateway', parameters: {{port: {port}}}}}"
    file.write_text(f"system: tiny\ncomponents:\n  gateway: {gateway}\n")
    found = regraft("up", str(file))
    assert found.exit_code == BAD_INPUT
    assert f"gateway cannot listen on 127.0.0.1:{port}" in found.stderr
    assert "--set gateway.port=" in found.stderr
    assert found.stdout == ""


NO_HOME = """\
import pathlib, sys
def no_home():
    raise RuntimeError("Could not determine home directory.")
pathlib.Path.home = no_home
sys.argv[0] = "regraft"
from regraft.cli.main import main
main()
"""
IN_A_FOLDER_THAT_IS_GONE = """\
import os, sys, tempfile
os.chdir(tempfile.mkdtemp())
os.rmdir(os.getcwd())
sys.argv[0] = "regraft"
from regraft.cli.main import main
main()
"""


def _ended(program: str, *words: str, env: dict[str, str] | None = None) -> str:
    """Return the one line with which a command ends that is refused."""
    command = [sys.executable, "-c", program, *words]
    done = subprocess.run(command, capture_output=True, text=True, timeout=PATIENCE, check=False, env=env)
    assert done.returncode == 2, done.stderr
    (line,) = done.stderr.splitlines()
    return line


def test_a_command_in_a_folder_that_is_gone_exits_with_2_and_one_line() -> None:
    gone = "the working folder is not there any more"
    assert _ended(IN_A_FOLDER_THAT_IS_GONE, "stack", "check", "none.yaml").startswith(f"regraft: {gone}")
    shown = json.loads(_ended(IN_A_FOLDER_THAT_IS_GONE, "stack", "check", "none.yaml", "--json"))
    assert shown == {"error": f"{gone}: change to another one", "code": "bad_input", "exit_code": 2}


def test_a_user_without_a_home_is_answered_in_json_where_that_is_asked_for() -> None:
    env = {name: value for name, value in os.environ.items() if name != "REGRAFT_HOME"}
    shown = json.loads(_ended(NO_HOME, "ps", "--json", env=env))
    assert "set REGRAFT_HOME" in shown["error"]
    assert (shown["code"], shown["exit_code"]) == ("bad_input", 2)


def test_a_command_of_a_user_without_a_home_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    def no_home() -> Path:
        raise RuntimeError("Could not determine home directory.")

    monkeypatch.delenv("REGRAFT_HOME", raising=False)
    monkeypatch.setattr(Path, "home", no_home)
    with pytest.raises(run_directory.NoHome, match="set REGRAFT_HOME"):
        run_directory.home()


@pytest.fixture
def out_of_reach(home: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Have the systems' files be in a folder that nobody can look into, whatever the user may do."""
    place = home / LONGER_THAN_A_NAME
    monkeypatch.setenv("REGRAFT_HOME", str(place))
    return place


@pytest.mark.parametrize(
    "command", [("ps",), ("down",), ("events",), ("logs", "a"), ("logs", "a", "--system", "frog")], ids=" ".join
)
def test_a_home_that_cannot_be_read_is_named_in_one_line(
    regraft: Regraft, out_of_reach: Path, command: tuple[str, ...]
) -> None:
    found = regraft(*command)
    assert found.exit_code == BAD_INPUT, found.exception
    (line,) = found.stderr.splitlines()
    assert str(out_of_reach) in line


def test_a_home_that_cannot_be_read_is_a_finding_of_the_doctor(regraft: Regraft, out_of_reach: Path) -> None:
    found = regraft("doctor", "--json")
    assert found.exit_code == FAILED, found.exception
    problems = [each for each in json.loads(found.stdout)["findings"] if each["level"] == "problem"]
    assert {"home", "systems"} <= {each["check"] for each in problems if str(out_of_reach) in each["text"]}


@pytest.mark.parametrize("options", [(), ("--follow",)], ids=["once", "follow"])
def test_a_log_that_cannot_be_read_is_named_in_one_line(regraft: Regraft, home: Path, options: tuple[str, ...]) -> None:
    log = home / "frog" / "logs" / "talker.log"
    log.mkdir(parents=True)
    found = regraft("logs", "talker", "--system", "frog", *options)
    assert found.exit_code == BAD_INPUT, found.exception
    (line,) = found.stderr.splitlines()
    assert str(log) in line


def test_a_mistyped_module_is_named_though_a_folder_on_the_path_cannot_be_read(
    regraft: Regraft, home: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sys, "path", [str(home / LONGER_THAN_A_NAME), *sys.path])
    found = regraft("run", "no_such_module:Class")
    assert found.exit_code == BAD_INPUT, found.exception
    assert "no_such_module" in found.stderr


def test_a_relative_home_is_below_the_working_folder(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("REGRAFT_HOME", "runs")
    assert run_directory.folder("tiny") == tmp_path / "runs" / "tiny"


def test_errors_of_the_kit_have_the_documented_exit_codes() -> None:
    bad = (NoSuchComponent("a"), NoSuchHost("a"), StackError([Problem("f", 1, "a", "b")]), NoPort("a"))
    assert [exit_code(error) for error in bad] == [BAD_INPUT] * 4
    assert [exit_code(error) for error in (NoAnswer("a"), BusError("a"))] == [NOT_REACHABLE] * 2
    assert [exit_code(error) for error in (ClientError("a"), CallFailed("a", None, "b"))] == [FAILED] * 2
    assert exit_code(KeyError("a")) is None


@pytest.mark.parametrize(
    ("overrides", "told"),
    [
        ((), "stack.yaml:5: components.bt_executor.parameters.mission: '{folder}/patrl.xml': "),
        (
            ("--set", "bt_executor.mission={folder}/ptrol.xml"),
            "--set bt_executor.mission={folder}/ptrol.xml: components.bt_executor.parameters.mission: ",
        ),
    ],
)
def test_a_missing_mission_is_told_before_anything_starts(
    regraft: Regraft, tmp_path: Path, overrides: tuple[str, ...], told: str
) -> None:
    (tmp_path / "patrol.xml").write_text("")
    mission = "patrol.xml" if overrides else "patrl.xml"
    (tmp_path / "stack.yaml").write_text(
        f"""\
system: patrol
topics: {{mission: regraft/MissionStatus}}
components:
  gateway: {{class: 'regraft.dashboard_api.gateway:Gateway', parameters: {{port: 0}}}}
  bt_executor: {{class: 'regraft.services.bt_executor.executor:Executor', parameters: {{mission: {mission}}}}}
"""
    )
    found = regraft("up", str(tmp_path), "--for", "1", *(text.format(folder=tmp_path) for text in overrides))
    assert found.exit_code == BAD_INPUT
    assert told.format(folder=tmp_path) in found.stderr
    assert f"did you mean '{tmp_path}/patrol.xml'?" in found.stderr
    assert not run_directory.folder("patrol").exists()
