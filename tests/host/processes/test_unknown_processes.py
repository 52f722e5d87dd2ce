"""A process that is not known is not named: no message speaks of process 0, and no signal goes there."""

from __future__ import annotations

import json
import subprocess
from pathlib import Path

import pytest

from regraft import run_directory
from regraft.bus_schema.messages.protocol.joining import JoinHost
from regraft.bus_schema.model.architecture import Architecture
from regraft.host.host_publisher import Refused
from regraft.host.joining.joined_hosts import JoinedHosts
from regraft.run_directory import AlreadyRunning, NotRunning, RunInfo

ARCHITECTURE = Architecture("tests", 1, False, {}, {}, ("local", "edge"))


@pytest.mark.parametrize(("pid", "told"), [(0, ""), (42, " (process 42)")])
def test_a_host_that_does_not_say_its_process_is_told_without(pid: int, told: str) -> None:
    events: list[str] = []
    others = JoinedHosts(lambda: ARCHITECTURE, lambda kind, host, text: events.append(text), lambda host: None)
    others.join(JoinHost("edge", "one", pid=pid))
    assert events == [f"host edge has joined{told}"]
    with pytest.raises(Refused) as refused:
        others.check(JoinHost("edge", "another"))
    assert str(refused.value) == f"a host 'edge' has joined already{told}: choose another --name"


@pytest.fixture
def home(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return an empty home for systems."""
    monkeypatch.setenv("REGRAFT_HOME", str(tmp_path))
    return tmp_path


@pytest.mark.parametrize("pid", [0, -1, None, "7"])
def test_a_damaged_run_file_names_no_process(home: Path, pid: object) -> None:
    held = run_directory.lock("frog")
    run_directory.write_info(RunInfo("frog", "1", 42, "tcp/127.0.0.1:1", "stack.yaml", False))
    file = home / "frog" / "run.json"
    file.write_text(json.dumps(json.loads(file.read_text()) | {"pid": pid}))
    with pytest.raises(NotRunning):
        run_directory.find("frog")
    with pytest.raises(AlreadyRunning, match="a system named 'frog' is already running: end it"):
        run_directory.lock("frog")
    held.close()


def test_the_process_of_a_run_that_was_killed_is_not_taken_for_the_next_ones(home: Path) -> None:
    run_directory.lock("frog").close()
    run_directory.write_info(RunInfo("frog", "1", 42, "tcp/127.0.0.1:1", "stack.yaml", False))
    starting = run_directory.lock("frog")
    with pytest.raises(AlreadyRunning) as refused:
        run_directory.lock("frog")
    assert "42" not in str(refused.value)
    starting.close()


def test_a_lock_is_free_once_its_system_has_ended_though_a_killed_child_has_the_file_open(home: Path) -> None:
    held = run_directory.lock("frog")
    with subprocess.Popen(["sleep", "60"], pass_fds=[held.fileno()]) as child:
        try:
            run_directory.unlock(held)
            run_directory.unlock(run_directory.lock("frog"))
        finally:
            child.kill()
