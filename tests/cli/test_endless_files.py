"""Whatever file a command is given, it reads no more of it than such a file may hold."""

from __future__ import annotations

import resource
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from tests.cli.live import Done, regraft
from tests.support.paths import ROOT
from tests.support.waiting import PATIENCE

ENOUGH = 4_000_000
"""KiB of addresses that a command may have: more than it needs, and soon filled by a file without end."""
MORE = 2_000_000
"""KiB of addresses that a command may take in a process which has what it needs."""
ENDLESS = Path("/dev/zero")
COMMANDS = (
    "adapt FILE",
    "planner propose bandits FILE",
    "mission check FILE",
    "mission check regraft/stacks/frog/mission.xml --nodes FILE",
    "mission load FILE",
    "certificates FOLDER local",
    "token list --system endless",
)
COMMANDS_THAT_RUN_A_HOST = (
    "up FILE",
    "up regraft/stacks/frog --secret FILE",
    "up regraft/stacks/frog --listen tls/127.0.0.1:7999 --tls FOLDER",
    "host --join tls/127.0.0.1:7999 --name local --tls FOLDER",
)


@pytest.fixture
def home(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return a home among files without end, all of the names that commands read."""
    home, folder = tmp_path / "home", tmp_path / "folder"
    monkeypatch.setenv("REGRAFT_HOME", str(home))
    monkeypatch.chdir(ROOT)
    names = ("ca.pem", "local.pem", "local.key", "bus.secret")
    for link in (tmp_path / "endless.xml", home / "endless" / "tokens.json", *(folder / name for name in names)):
        link.parent.mkdir(parents=True, exist_ok=True)
        link.symlink_to(ENDLESS)
    return home


def typed(command: str, home: Path) -> str:
    """Return a command with the names of the files."""
    return command.replace("FILE", f"{home.parent}/endless.xml").replace("FOLDER", f"{home.parent}/folder")


def check(done: Done) -> None:
    """Check that a command refused its file in one line."""
    assert done.returncode == 2, done
    assert done.stderr.startswith("regraft: ")
    assert done.stderr.count("\n") == 1


@contextmanager
def little_memory() -> Iterator[None]:
    """Let this process take no more than some memory in the block."""
    pages = int(Path("/proc/self/statm").read_text().split()[0])
    before = resource.getrlimit(resource.RLIMIT_AS)
    resource.setrlimit(resource.RLIMIT_AS, (pages * resource.getpagesize() + 1024 * MORE, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_AS, before)


@pytest.mark.parametrize("command", COMMANDS)
def test_a_file_without_end_is_refused(command: str, home: Path) -> None:
    with little_memory():
        done = regraft(home, *typed(command, home).split())
    check(done)


@pytest.mark.parametrize("command", COMMANDS_THAT_RUN_A_HOST)
def test_a_file_without_end_is_refused_before_a_host_runs(command: str, home: Path) -> None:
    ran = subprocess.run(
        ["sh", "-c", f"ulimit -v {ENOUGH}; exec {sys.executable} -m regraft.cli {typed(command, home)}"],
        capture_output=True,
        text=True,
        timeout=PATIENCE,
        check=False,
    )
    check(Done(ran.returncode, ran.stdout, ran.stderr))
