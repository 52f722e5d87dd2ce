"""No test may end what runs the tests."""

from __future__ import annotations

import re

from tests.support.paths import ROOT

CHECKED = "tests/support/machine/processes.py"
"""Sends signals, and refuses process 0: all that runs the tests, and all that has started them."""


def test_signals_to_other_processes_are_sent_where_process_0_is_refused() -> None:
    unchecked = re.compile(r"os\.kill(?!\(os\.getpid\(\))\b|os\.killpg")
    found = [
        f"{path.relative_to(ROOT)}:{number}"
        for path in sorted((ROOT / "tests").rglob("*.py"))
        for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), 1)
        if unchecked.search(line)
    ]
    assert [place.partition(":")[0] for place in found] == [CHECKED], found
