"""Starting and ending at bad moments: nothing is left running, and the next start works."""

from __future__ import annotations

import json
import os
import re
import signal
import socket
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from regraft import run_directory
from regraft.run_directory import RunInfo
from tests.hostile.components.test_broken_stacks import refusal, up
from tests.hostile.conftest import SINK, SOURCE, Start
from tests.support.commands import AnyProcess, Command
from tests.support.machine.processes import children_of, exists, wait_gone
from tests.support.waiting import PATIENCE, wait_until

pytestmark = pytest.mark.slow

Write = Callable[..., Path]
Begin = Callable[..., AnyProcess]

MANY = "".join(SOURCE.replace("source:", f"source_{n}:") for n in range(6)) + SINK


@pytest.fixture
def begin() -> Iterator[Begin]:
    """Return what has a system start; one that a test leaves running is killed."""
    begun: list[Command] = []

    def start(stack: Path, *options: str, hangups: signal.Handlers = signal.SIG_DFL) -> AnyProcess:
        words = ("up", str(stack), "--headless", *options)
        log = stack.parent / "up.log"
        begun.append(Command(*words, log=log, prepare=lambda: _as_a_shell_starts_it(hangups)))
        return begun[-1].process

    yield start
    for command in begun:
        command.kill()


def _as_a_shell_starts_it(hangups: signal.Handlers) -> None:
    """Undo what a shell does to jobs in its background: they ignore SIGINT, and so would all that they start."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    signal.signal(signal.SIGHUP, hangups)


def _processes(process: AnyProcess, least: int) -> list[int]:
    found: list[int] = []

    def there() -> bool:
        nonlocal found
        found = children_of(process.pid)
        return len(found) >= least or process.poll() is not None

    wait_until(there, f"{least} processes")
    return found


def _log(stack: Path) -> str:
    return (stack.parent / "up.log").read_text()


@pytest.mark.parametrize(
    ("signum", "processes"),
    [
        *((signal.SIGINT, processes) for processes in (1, 2, 5)),
        *((signum, 2) for signum in (signal.SIGTERM, signal.SIGHUP)),
        *(
            pytest.param(signum, processes, marks=pytest.mark.evidence)
            for signum in (signal.SIGTERM, signal.SIGHUP)
            for processes in (1, 5)
        ),
    ],
)
def test_a_start_that_is_interrupted_leaves_nothing(
    stack: Write, begin: Begin, signum: signal.Signals, processes: int
) -> None:
    path = stack(MANY)
    process = begin(path)
    pids = _processes(process, processes)
    process.send_signal(signum)
    assert process.wait(PATIENCE) in (0, 130, -signum), _log(path)
    assert "Traceback" not in _log(path)
    wait_gone(pids)
    wait_until(lambda: not run_directory.running(), "the lock to be free")
    assert not (run_directory.folder("tests") / "run.json").exists()


IN_A_CALLBACK = """
import os, signal
from tests.hostile.parts import Source

def interrupt():
    os.kill(os.getpid(), signal.SIGINT)

class Dropped:
    def __del__(self):
        interrupt()

class Early(Source):
    @classmethod
    def preload(cls):
        {preload}

{imported}
"""


@pytest.mark.parametrize(
    ("imported", "preload"),
    [
        ("os.register_at_fork(before=interrupt)", "pass"),
        ("os.register_at_fork(after_in_parent=interrupt)", "pass"),
        ("", "Dropped()"),
    ],
    ids=["before_the_fork", "after_the_fork", "while_preparing"],
)
def test_an_interrupt_is_heard_also_where_python_drops_its_exception(
    stack: Write, begin: Begin, imported: str, preload: str
) -> None:
    path = stack(SOURCE.replace("tests.hostile.parts:Source", "early:Early"))
    (path.parent / "early.py").write_text(IN_A_CALLBACK.format(imported=imported, preload=preload))
    process = begin(path)
    assert process.wait(PATIENCE) == 130, _log(path)
    assert "active" not in _log(path)
    wait_until(lambda: not run_directory.running(), "the lock to be free")
    assert not (run_directory.folder("tests") / "run.json").exists()


SLOW_WORLD = """
import time
from tests.stepped.parts import TinyWorld

class SlowWorld(TinyWorld):
    handler_timeout = 100.0

    def on_configure(self):
        time.sleep(100.0)
"""
SIMULATED = """\
system: tests
clock: simulated
imports: [tests.hostile.parts]
topics:
  position: {type: stepped_tests/Reading}
  numbers: {type: hostile_tests/Number}
components:
  world: {class: 'slow_world:SlowWorld'}
"""


def test_components_that_wait_for_their_start_are_not_said_to_have_stopped(stack: Write, begin: Begin) -> None:
    path = stack(SOURCE, SIMULATED)
    (path.parent / "slow_world.py").write_text(SLOW_WORLD)
    process = begin(path, "--for", "10")
    wait_until(lambda: "0 of 2 components active" in _log(path) or process.poll() is not None, "the start")
    process.send_signal(signal.SIGINT)
    assert process.wait(PATIENCE) == 1, _log(path)
    told = _log(path).splitlines()[-1]
    assert "never came up: world (" in told
    assert "not started yet: source" in told
    assert "stopped" not in told


def test_what_nohup_started_outlives_its_terminal(stack: Write, begin: Begin) -> None:
    path = stack(SOURCE)
    process = begin(path, "--for", "1", hangups=signal.SIG_IGN)
    wait_until(lambda: "components active" in _log(path), "the start")
    process.send_signal(signal.SIGHUP)
    assert process.wait(PATIENCE) == 0
    (ran,) = re.findall(r"ran ([0-9.]+) s", _log(path))
    assert float(ran) >= 1.0


@pytest.mark.parametrize("processes", [1, 3])
def test_a_start_that_is_killed_leaves_nothing_and_the_next_one_works(
    stack: Write, begin: Begin, processes: int
) -> None:
    path = stack(MANY)
    process = begin(path)
    pids = _processes(process, processes)
    process.kill()
    process.wait()
    wait_gone(pids)
    wait_until(lambda: not run_directory.running(), "the last process to let go of the lock")
    done = up(path, "--for", "0.2")
    assert done.returncode == 0, done.stdout + done.stderr


def test_asking_to_end_again_and_again_is_as_good_as_once(start: Start) -> None:
    system = start(SOURCE + "  deaf: {class: 'tests.hostile.parts:Deaf'}\n")
    system.wait_running("deaf")
    pids = children_of(system.process.pid)
    for signum in (signal.SIGTERM, signal.SIGTERM, signal.SIGINT, signal.SIGHUP, signal.SIGTERM):
        system.process.send_signal(signum)
    assert system.process.wait(PATIENCE) == 0
    assert "Traceback" not in system.log.read_text()
    assert not [pid for pid in pids if exists(pid)]


def test_what_a_killed_run_leaves_behind_is_no_running_system(start: Start, stack: Write) -> None:
    system = start(SOURCE + SINK)
    system.wait_running("sink")
    pids = children_of(system.process.pid)
    system.client.close()
    system.process.kill()
    system.process.wait()
    wait_gone(pids)
    assert (run_directory.folder("tests") / "run.json").exists()
    wait_until(lambda: not run_directory.running(), "the lock to be free")
    with pytest.raises(run_directory.NotRunning, match="no system named 'tests' is running"):
        run_directory.find("tests")
    done = up(stack(SOURCE + SINK), "--for", "0.2")
    assert done.returncode == 0, done.stdout + done.stderr


@pytest.mark.parametrize(
    "left", ["", "{", "[]", '{"system": 1}', json.dumps({"system": "tests", "pid": "x"}), "\0" * 100, '"' + "[" * 9000]
)
def test_a_run_file_that_is_none_is_no_running_system(stack: Write, left: str) -> None:
    stack(SOURCE)
    _leave(left)
    assert run_directory.running() == []
    with run_directory.lock("tests"):
        assert run_directory.running() == []
        info = RunInfo("tests", "1", os.getpid(), "tcp/127.0.0.1:1", "stack.yaml", False)
        run_directory.write_info(info)
        assert run_directory.running() == [info]


def test_what_others_left_in_the_folder_stops_no_start(stack: Write) -> None:
    path = stack(SOURCE)
    _leave("{")
    done = up(path, "--for", "0.1")
    assert done.returncode == 0, done.stdout + done.stderr


def _leave(text: str) -> None:
    """Leave a run file that says ``text``, and a lock that nobody holds."""
    folder = run_directory.folder("tests")
    folder.mkdir(parents=True)
    (folder / "run.json").write_text(text)
    (folder / "lock").write_text("12345")


def test_a_second_start_is_refused_and_the_first_goes_on(start: Start) -> None:
    system = start(SOURCE + SINK)
    system.wait_running("sink")
    done = up(system.log.parent / "stack.yaml")
    assert done.returncode == 2
    assert "already running" in done.stderr
    assert str(system.process.pid) in done.stderr
    assert run_directory.find("tests").pid == system.process.pid
    assert system.processes()["sink"].incarnation == 1


def test_a_start_is_not_taken_for_the_killed_run_before_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("REGRAFT_HOME", str(tmp_path))
    run_directory.lock("tests").close()
    run_directory.write_info(RunInfo("tests", "run", 1, "tcp/127.0.0.1:1", "stack.yaml", simulated=False))
    with run_directory.lock("tests"):
        assert run_directory.is_running("tests")
        assert run_directory.running() == [], "it has not said yet how to reach it"


def test_a_home_that_cannot_be_written_is_said(stack: Write, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = stack(SOURCE)
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("REGRAFT_HOME", str(tmp_path / "file"))
    done = up(path)
    assert done.returncode == 2, done.stdout + done.stderr
    assert str(tmp_path / "file") in done.stderr
    assert "Traceback" not in done.stderr


def test_a_gateway_port_in_use_is_refused_before_anything_runs(stack: Write) -> None:
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = taken.getsockname()[1]
        gateway = f"  g: {{class: 'regraft.dashboard_api.gateway:Gateway', parameters: {{port: {port}}}}}\n"
        assert f"127.0.0.1:{port}" in refusal(stack(SOURCE + gateway))
    wait_until(lambda: not run_directory.running(), "the lock to be free")


def test_a_class_that_is_slow_to_import_can_be_interrupted(stack: Write, begin: Begin) -> None:
    path = stack("  late: {class: 'tests.hostile.components.slow_import:Late'}\n")
    process = begin(path)
    wait_until(lambda: _has_begun(process.pid), "the import")
    process.send_signal(signal.SIGINT)
    assert process.wait(PATIENCE) == 130
    assert "Traceback" not in _log(path)
    wait_until(lambda: not run_directory.running(), "the lock to be free")


def _has_begun(pid: int) -> bool:
    """Tell whether a process is past its own start and waits for something."""
    try:
        maps = Path(f"/proc/{pid}/maps").read_text()
        state = Path(f"/proc/{pid}/wchan").read_text()
    except OSError:
        return False
    return "zenoh" in maps and "sleep" in state and os.getpid() != pid
