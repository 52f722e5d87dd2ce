"""Every session of a system proves that it belongs to it: strangers on the same machine see and change nothing."""

from __future__ import annotations

import contextlib
import os
import stat
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

import pytest

from regraft import run_directory
from regraft.bus.interface import BusError
from regraft.bus.zenoh_bus import open_bus
from regraft.bus.zenoh_config import Endpoints
from regraft.security.system_secret import BadSecret, make, read
from tests.host.conftest import HEAD, Start
from tests.host.several import TICKER, WAIT, Site
from tests.support.commands import run
from tests.support.machine.ports import free_port
from tests.support.machine.processes import children_of
from tests.support.systems import System, all_ended, home
from tests.support.waiting import PATIENCE

pytestmark = pytest.mark.slow

TICKERS = "  ticker: {class: 'tests.host.parts:Ticker'}\n"
SIMULATED = """\
system: tests
clock: simulated
seed: 1
imports: [tests.stepped.parts]
topics: {position: {type: stepped_tests/Reading}}
components:
  world: {class: 'tests.stepped.parts:TinyWorld'}
"""
LISTENING = "0A"
OTHER_USER = """
import os, sys, zenoh
os.setgroups([])
os.setgid(65534)
os.setuid(65534)
endpoint, *files = sys.argv[1:]
for name in files:
    try:
        open(name, "rb").read(1)
        print("can read", name)
    except OSError:
        pass
config = zenoh.Config()
config.insert_json5("mode", '"client"')
config.insert_json5("connect/endpoints", f'["{endpoint}"]')
config.insert_json5("scouting/multicast/enabled", "false")
try:
    zenoh.open(config)
    print("is admitted")
except zenoh.ZError:
    print("is refused")
"""


def listening(pid: int) -> Iterator[int]:
    """Yield the TCP ports at which a process and its descendants listen."""
    inodes = set()
    for process in (pid, *children_of(pid)):
        for descriptor in Path(f"/proc/{process}/fd").iterdir():
            with contextlib.suppress(FileNotFoundError):  # a running process closes some as they are read
                inodes.add(os.readlink(descriptor).removeprefix("socket:[").removesuffix("]"))
    for line in Path("/proc/net/tcp").read_text().splitlines()[1:]:
        fields = line.split()
        if fields[3] == LISTENING and fields[9] in inodes:
            yield int(fields[1].rpartition(":")[2], 16)


def refused(endpoint: str, secret: str = "") -> None:
    """See that a session is not admitted."""
    with pytest.raises(BusError):
        open_bus(Endpoints(connect=(endpoint,), secret=secret))


@pytest.fixture(scope="module")
def system(tmp_path_factory: pytest.TempPathFactory) -> Iterator[System]:
    """Return a system with a ticker."""
    folder = tmp_path_factory.mktemp("secret")
    (folder / "stack.yaml").write_text(HEAD + TICKERS)
    with home(folder / "home"), all_ended() as started:
        started.append(System(folder / "stack.yaml"))
        started[0].wait_running("ticker")
        yield started[0]


def test_no_door_of_a_system_lets_a_session_in_that_has_no_or_another_secret(system: System) -> None:
    ports = set(listening(system.process.pid))
    assert ports == {int(system.info.endpoint.rpartition(":")[2])}
    for port in ports:
        refused(f"tcp/127.0.0.1:{port}")
        refused(f"tcp/127.0.0.1:{port}", "x" * 43)
    open_bus(system.info.hub).close()


@pytest.mark.parametrize("name", ["short", "long" * 25])
def test_the_worlds_own_door_is_as_narrow(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """It has a port for the host, and for components a Unix socket in the system's folder: a port where none fits."""
    with tempfile.TemporaryDirectory(prefix="regraft-", dir="/tmp") as folder:
        monkeypatch.setenv("REGRAFT_HOME", f"{folder}/{name}")
        stack = Path(folder) / "stack.yaml"
        stack.write_text(SIMULATED)
        system = System(stack)
        try:
            system.wait_running("world")
            doors = {f"tcp/127.0.0.1:{port}" for port in listening(system.process.pid)}
            files = [file for found in ("clock", "tools") for file in Path(folder).rglob(f"{found}.sock")]
            assert (len(doors), len(files)) == ((2, 2) if name == "short" else (3, 0)), "the host and the world listen"
            doors |= {f"unixsock-stream/{file}" for file in files}
            for door in doors:
                refused(door)
                open_bus(Endpoints(connect=(door,), secret=system.info.secret), lockstep=True).close()
        finally:
            system.end()


def test_a_router_that_is_no_member_is_not_linked(system: System) -> None:
    listen = f"tcp/127.0.0.1:{free_port()}"
    bus = open_bus(Endpoints((listen,), (system.info.endpoint,), router=True, secret="y" * 43))
    try:
        assert bus.present("**", 1.0) == []
    finally:
        bus.close()


def test_only_its_user_can_read_what_a_system_keeps(system: System) -> None:
    assert not stat.S_IMODE(run_directory.folder("tests").stat().st_mode) & 0o077, "nobody else reaches what is in it"
    assert stat.S_IMODE((run_directory.folder("tests") / "run.json").stat().st_mode) == 0o600
    assert system.info.secret not in Path(system.log).read_text()
    for log in run_directory.folder("tests").glob("logs/*"):
        assert system.info.secret not in log.read_text()


@pytest.mark.skipif(os.geteuid() != 0, reason="only root can act as another user")
def test_another_user_of_the_machine_gets_neither_in_nor_at_the_secret(system: System) -> None:
    pid = system.wait_running("ticker").pid
    files = [str(run_directory.folder("tests") / "run.json"), f"/proc/{pid}/environ", f"/proc/{system.process.pid}/mem"]
    command = [sys.executable, "-c", OTHER_USER, system.info.endpoint, *files]
    other = subprocess.run(command, capture_output=True, text=True, timeout=PATIENCE, check=False)
    assert other.stdout == "is refused\n", other.stderr


def test_a_program_of_the_stack_is_told_the_secret(start: Start) -> None:
    told = "import json, os; print(json.loads(os.environ['REGRAFT_ASSIGNMENT'])['secret'], flush=True)"
    command = f'["{sys.executable}", "-c", "{told}"]'
    system = start(f"  program: {{command: {command}, managed: false, restart: {{when: never}}}}\n")
    system.wait_for("program", lambda p: p.exit_reason, "ended")
    assert system.client.logs("program")[-1] == system.info.secret


# --- hosts ---


def _host(*arguments: str) -> tuple[int, str]:
    done = run("host", *arguments)
    return done.returncode, done.stderr


def test_a_host_joins_with_the_secret_of_the_system_and_with_no_other(
    site: Site, monkeypatch: pytest.MonkeyPatch
) -> None:
    secret, other = site.folder / "secret", site.folder / "other"
    site.up(TICKER, WAIT, "--secret", str(secret))
    assert site.system.info.secret == read(secret)
    make(other)
    endpoint = site.system.info.endpoint
    code, said = _host("--join", endpoint, "--name", "edge", "--secret", str(other))
    assert code == 3
    assert "another secret" in said
    monkeypatch.setenv("REGRAFT_HOME", str(site.folder / "elsewhere"))
    code, said = _host("--join", endpoint, "--name", "edge")
    assert code == 2
    assert "--secret FILE" in said
    monkeypatch.setenv("REGRAFT_HOME", str(site.folder / "home"))
    site.join("edge", endpoint, "--secret", str(secret))
    site.wait_active("ticker")


def test_a_secret_that_others_may_read_or_that_is_none_is_refused(tmp_path: Path) -> None:
    file = tmp_path / "secret"
    assert make(file)
    assert not make(file), "it is made once"
    assert read(file) == read(file)
    file.chmod(0o644)
    with pytest.raises(BadSecret, match="chmod 600"):
        read(file)
    file.chmod(0o600)
    file.write_text("two words\n")
    with pytest.raises(BadSecret, match="16 to 256"):
        read(file)
    with pytest.raises(BadSecret, match="No such file"):
        read(tmp_path / "none")
