"""Zenoh's files in /dev/shm: none of a system stays, whatever became of its processes, and nobody else loses one."""

from __future__ import annotations

import json
import signal
from collections.abc import Callable, Iterable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

import pytest

from regraft import run_directory
from tests.support.commands import AnyProcess, Command, run
from tests.support.machine.processes import children_of, kill
from tests.support.waiting import wait_until

pytestmark = pytest.mark.slow

Write = Callable[..., Path]

HEAVY = """
from regraft import Component, Output, every
from tests.hostile.parts import Number

class Heavy(Component):
    numbers = Output(Number)

    @every(hz=20)
    def tell(self):
        self.numbers.publish(Number(1.0, bytes(200_000)))
"""
COMPONENTS = """\
  source: {class: 'heavy:Heavy'}
  sink: {class: 'tests.hostile.parts:Sink'}
"""


@contextmanager
def _process(log: Path, *arguments: str) -> Iterator[AnyProcess]:
    """Run a command until the block ends, then interrupt it as Ctrl-C does."""
    command = Command(*arguments, log=log, prepare=lambda: signal.signal(signal.SIGINT, signal.default_int_handler))
    try:
        yield command.process
        command.interrupt()
        command.ended()
    finally:
        command.kill()


def _files(pids: Iterable[int]) -> set[Path]:
    """Return the files in shared memory that processes use."""
    found = set()
    for pid in pids:
        try:
            lines = Path(f"/proc/{pid}/maps").read_text().splitlines()
        except OSError:
            continue
        found |= {Path(line[line.index("/dev/shm/") :]) for line in lines if line.endswith(".zenoh")}
    return found


def _wait_for(log: Path, line: str) -> None:
    wait_until(lambda: line in log.read_text(), f"{line!r} in:\n{log.read_text()}")


def _pid_of(component: str) -> int:
    """Return the process of a component, asked as a user asks."""
    (system,) = json.loads(run("ps", "--json").stdout)["systems"]
    (pid,) = (there["pid"] or 0 for there in system["components"] if there["name"] == component)
    return int(pid)


def test_nothing_of_hosts_clients_and_killed_components_stays(stack: Write, tmp_path: Path) -> None:
    path = stack(COMPONENTS)
    (tmp_path / "heavy.py").write_text(HEAVY)
    logs = {name: tmp_path / f"{name}.log" for name in ("up", "edge", "client")}
    used: set[Path] = set()
    with ExitStack() as running:
        up = running.enter_context(_process(logs["up"], "up", str(path), "--headless", "--place", "sink=edge"))
        wait_until(lambda: bool(run_directory.running()), "the system")
        join = ("host", "--join", run_directory.find("tests").join, "--name", "edge")
        edge = running.enter_context(_process(logs["edge"], *join))
        _wait_for(logs["up"], "all 2 components active")
        client = running.enter_context(_process(logs["client"], "topic", "hz", "numbers"))
        _wait_for(logs["client"], "Hz")
        everybody = [process.pid for process in (up, edge, client)]
        used |= _files([*everybody, *(pid for process in everybody for pid in children_of(process))])
        killed = _pid_of("source")
        kill(killed)
        _wait_for(logs["up"], "source ended: killed by SIGKILL")  # asking costs what it takes to start a command
        wait_until(lambda: _pid_of("source") not in (0, killed), "another source")
        used |= _files([*everybody, *(pid for process in everybody for pid in children_of(process))])
    assert len(used) >= 6
    assert not [file for file in used if file.exists()]


def test_the_end_of_one_system_takes_nothing_from_another(stack: Write, tmp_path: Path) -> None:
    path = stack(COMPONENTS)
    (tmp_path / "heavy.py").write_text(HEAVY)
    log, other_log = tmp_path / "up.log", tmp_path / "other.log"
    with _process(log, "up", str(path), "--headless") as up:
        _wait_for(log, "all 2 components active")
        wait_until(lambda: len(_files([up.pid, *children_of(up.pid)])) >= 4, "a pool beside a file for each session")
        used = _files([up.pid, *children_of(up.pid)])
        with _process(other_log, "up", str(path), "--headless", "--system", "other"):
            _wait_for(other_log, "all 2 components active")
        assert not [file for file in used if not file.exists()]
