"""Whatever file a command is given, it reads no more of it than such a file may hold."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from tests.support.paths import ROOT
from tests.support.waiting import PATIENCE

ENOUGH = 4_000_000
"""KiB of addresses that a command may have: more than it needs, and soon filled by a file without end."""
ENDLESS = Path("/dev/zero")
COMMANDS = (
    "up FILE",
    "up regraft/stacks/frog --secret FILE",
    "up regraft/stacks/frog --listen tls/127.0.0.1:7999 --tls FOLDER",
    "host --join tls/127.0.0.1:7999 --name local --tls FOLDER",
    "adapt FILE",
    "planner propose bandits FILE",
    "mission check FILE",
    "mission check regraft/stacks/frog/mission.xml --nodes FILE",
    "mission load FILE",
    "certificates FOLDER local",
    "token list --system endless",
)


@pytest.mark.parametrize("command", COMMANDS)
def test_a_file_without_end_is_refused(command: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("REGRAFT_HOME", str(tmp_path / "home"))
    file, folder, kept = tmp_path / "endless.xml", tmp_path / "folder", tmp_path / "home" / "endless" / "tokens.json"
    for link in (file, kept, *(folder / name for name in ("ca.pem", "local.pem", "local.key", "bus.secret"))):
        link.parent.mkdir(parents=True, exist_ok=True)
        link.symlink_to(ENDLESS)
    typed = command.replace("FILE", str(file)).replace("FOLDER", str(folder))
    ran = subprocess.run(
        ["sh", "-c", f"ulimit -v {ENOUGH}; exec {sys.executable} -m regraft.cli {typed}"],
        cwd=ROOT,
        capture_output=True,
        text=True,
        timeout=PATIENCE,
        check=False,
    )
    assert ran.returncode == 2, ran.stderr
    assert ran.stderr.startswith("regraft: ")
    assert ran.stderr.count("\n") == 1
