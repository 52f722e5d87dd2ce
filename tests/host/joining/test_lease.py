"""A component's own lease: when it has run out, the process ends, whatever else is wrong."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from regraft.runtime.core.lease import GrantedLease, now

BOUND = 30.0
HOLDER = """\
import sys, threading
from regraft.runtime.core.lease import HeldLease
HeldLease("holder", sys.argv[1])
print("held", flush=True)
threading.Event().wait()
"""
LOOKER = """\
import sys
from regraft.runtime.core.lease import HeldLease
held = HeldLease("holder", sys.argv[1])
print("held", flush=True)
for _ in range(1_000_000):
    held.check()
"""


@pytest.mark.parametrize("errors", ["open", "full", "closed", "replaced"])
def test_whose_lease_has_run_out_ends_whatever_takes_its_last_line(tmp_path: Path, errors: str) -> None:
    granted = GrantedLease("holder", float("inf"))
    begin = {"closed": "import os; os.close(2)\n", "replaced": "import sys; sys.__stderr__.close()\n"}.get(errors, "")
    log = tmp_path / "log"
    with (
        open("/dev/full" if errors == "full" else log, "wb") as stderr,
        subprocess.Popen(
            [sys.executable, "-c", begin + HOLDER, granted.path],
            stdout=subprocess.PIPE,
            stderr=stderr,
            env={**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)},
        ) as holder,
    ):
        assert holder.stdout
        assert holder.stdout.readline() == b"held\n"
        granted.extend(now())
        try:
            assert holder.wait(BOUND) == -signal.SIGKILL
        finally:
            holder.kill()
    if errors in ("open", "replaced"):
        assert log.read_text() == (
            "holder ends itself: its host has lost the system, and it may be started elsewhere\n"
        )


def test_a_lease_that_is_extended_while_it_is_looked_at_holds() -> None:
    granted = GrantedLease("holder", now() + BOUND)
    with subprocess.Popen(
        [sys.executable, "-c", LOOKER, granted.path],
        stdout=subprocess.PIPE,
        env={**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)},
    ) as looker:
        assert looker.stdout
        assert looker.stdout.readline() == b"held\n"
        try:
            while looker.poll() is None:
                granted.extend(now() + BOUND)
            assert looker.returncode == 0
        finally:
            looker.kill()
