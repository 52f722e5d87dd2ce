"""Standard streams that are closed or full, and too few open files: a clear line, the right exit code, no hang."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest

from tests.cli.live import STACK
from tests.support.commands import in_home
from tests.support.waiting import PATIENCE

pytestmark = pytest.mark.slow

CLOSED, FULL = (">&-", "it is closed"), (">/dev/full", "No space left on device")
ALL_CLOSED = "<&- >&- 2>&-"
SILENT = ("2>&-", "2>/dev/full", ALL_CLOSED)
COMMANDS = ("--help", "ps", "types", "doctor", "evaluate --help")
REFUSED = ("up nowhere", "run nowhere:Class", "up")
UNREACHED = ("events", "planner list")


def run(typed: str, home: Path, before: str = "") -> subprocess.CompletedProcess[str]:
    """Run a command, redirections and all, ``before`` it a command of the shell."""
    return subprocess.run(
        ["sh", "-c", f"{before}{sys.executable} -m regraft.cli {typed}"],
        cwd=home,
        env=in_home(home),
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        timeout=PATIENCE,
        check=False,
    )


def evidence(*case: object) -> object:
    """Return a case for make evidence: each starts an interpreter, and the first ones show every way to print."""
    return pytest.param(*case, marks=pytest.mark.evidence)


@pytest.mark.parametrize(
    ("command", "redirected", "why"),
    [
        ("ps", *CLOSED),
        ("ps", *FULL),
        ("--help", *CLOSED),
        ("types", *FULL),
        ("evaluate --help", *FULL),
        *(evidence(command, *how) for command in COMMANDS for how in (CLOSED, FULL)),
    ],
)
def test_output_that_cannot_be_written_fails_with_one_line(
    command: str, redirected: str, why: str, tmp_path: Path
) -> None:
    ran = run(f"{command} {redirected}", tmp_path)
    assert (ran.returncode, ran.stderr) == (1, f"regraft: cannot write to standard output: {why}\n")


@pytest.mark.parametrize(
    ("command", "code", "redirected"),
    [
        ("up nowhere", 2, "2>&-"),
        ("up", 2, "2>/dev/full"),
        ("run nowhere:Class", 2, ALL_CLOSED),
        ("events", 3, ALL_CLOSED),
        *(evidence(command, 2, how) for command in REFUSED for how in SILENT),
        *(evidence(command, 3, how) for command in UNREACHED for how in SILENT),
    ],
)
def test_the_exit_code_tells_when_no_line_can(command: str, code: int, redirected: str, tmp_path: Path) -> None:
    ran = run(f"{command} {redirected}", tmp_path)
    assert (ran.returncode, ran.stdout, ran.stderr) == (code, "", "")


@pytest.mark.parametrize("command", ["--help", "up", *map(evidence, (*COMMANDS, *REFUSED, *UNREACHED))])
def test_too_few_open_files_are_refused_with_one_line(command: str, tmp_path: Path) -> None:
    ran = run(command, tmp_path, before="ulimit -n 20; ")
    assert (ran.returncode, ran.stdout) == (2, "")
    assert ran.stderr == "regraft: only 20 files may be open at once, and 64 are needed: raise 'ulimit -n'\n"


@pytest.mark.parametrize(
    ("redirected", "before"),
    [(">&-", ""), (">/dev/full", "ulimit -n 64; "), (ALL_CLOSED, ""), (ALL_CLOSED, "ulimit -n 64; ")],
)
def test_a_system_runs_on_when_its_output_cannot_be_written(redirected: str, before: str, tmp_path: Path) -> None:
    ran = run(f"up {STACK} --for 1 {redirected}", tmp_path, before)
    told = ran.stderr.splitlines()
    assert ran.returncode == 0, told
    assert ["; the system runs on, unseen" in line for line in told] == ([] if "2>" in redirected else [True])


def test_a_system_runs_on_when_nobody_reads_its_output_any_more(tmp_path: Path) -> None:
    command = [sys.executable, "-m", "regraft.cli", "up", str(STACK), "--for", "1"]
    pipe = subprocess.PIPE
    with subprocess.Popen(command, cwd=tmp_path, env=in_home(tmp_path), stdout=pipe, stderr=pipe, text=True) as up:
        assert up.stdout
        assert up.stdout.readline().startswith("system tiny ")
        up.stdout.close()
        try:
            told = up.communicate(timeout=2 * PATIENCE)[1].splitlines()
        finally:
            up.kill()
    assert up.returncode == 0, told
    assert len([line for line in told if "; the system runs on, unseen" in line]) == 1


@pytest.mark.parametrize("redirected", [">&-", ">/dev/full"])
def test_a_summary_that_cannot_be_written_is_a_failure(redirected: str, tmp_path: Path) -> None:
    ran = run(f"up {STACK} --for 1 --json {redirected}", tmp_path)
    assert ran.returncode == 1
    shown = json.loads(ran.stderr)
    assert shown["error"].startswith("cannot write to standard output: ")
    assert shown["code"] == "failed"
    assert ran.stderr.count("\n") == 1
