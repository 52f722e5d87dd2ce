"""How processes of a system in simulated time are scheduled, and that a user's own policy stands."""

from __future__ import annotations

import subprocess
import sys

import pytest

from tests.support.waiting import PATIENCE

TRY = """
import os
from regraft.process.scheduling import work_in_batches
os.sched_setscheduler(0, os.{policy}, os.sched_param(0))
print(work_in_batches(), os.sched_getscheduler(0) == os.{then})
"""


@pytest.mark.parametrize(
    ("policy", "then", "done"), [("SCHED_OTHER", "SCHED_BATCH", True), ("SCHED_IDLE", "SCHED_IDLE", False)]
)
def test_what_works_in_batches_is_batch_work_unless_a_user_has_said_otherwise(
    policy: str, then: str, done: bool
) -> None:
    text = TRY.format(policy=policy, then=then)
    told = subprocess.run(
        [sys.executable, "-c", text], capture_output=True, text=True, timeout=2 * PATIENCE, check=True
    )
    assert told.stdout.split() == [str(done), "True"]
