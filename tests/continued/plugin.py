"""Evidence in several sittings: what has passed on the very same files is not run again.

Loaded by ``pytest -p tests.continued.plugin``. Each outcome is a line of ``build/evidence/DIGEST.tsv``. The digest is
of every file of the project that git does not ignore, and of Python. A change of any of them begins anew.
"""

from __future__ import annotations

import hashlib
import subprocess
import sys
import time
from collections import defaultdict
from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pytest

FOLDER = Path("build/evidence")
PASSED = pytest.StashKey[Iterable[str]]()
SHARED = "passed_before"
"""Under this name the workers of xdist are told of the tests that have passed, so that all collect the same."""


@dataclass
class Record:
    """The outcomes of all sittings on the same files. ``seconds`` and ``parts`` are of tests under way."""

    path: Path
    outcomes: dict[str, list[str]] = field(default_factory=lambda: defaultdict(list))
    seconds: dict[str, float] = field(default_factory=lambda: defaultdict(float))
    parts: dict[str, set[str]] = field(default_factory=lambda: defaultdict(set))

    def read(self) -> None:
        """Take what earlier sittings have written. A line that was cut off counts for nothing."""
        if self.path.is_file():
            for line in self.path.read_text().splitlines():
                fields = line.split("\t")
                if len(fields) == 4:
                    self.outcomes[fields[3]].append(fields[0])

    def passed(self) -> list[str]:
        """Return the tests whose last outcome is that they passed."""
        return sorted(test for test, outcomes in self.outcomes.items() if outcomes[-1] == "passed")

    def take(self, report: pytest.TestReport) -> None:
        """Count one part of a test: its set-up, its call or its end; write its outcome at its end."""
        self.parts[report.nodeid].add(report.outcome)
        self.seconds[report.nodeid] += report.duration
        if report.when != "teardown":
            return
        parts = self.parts.pop(report.nodeid)
        outcome = next(outcome for outcome in ("failed", "skipped", "passed") if outcome in parts)
        self.outcomes[report.nodeid].append(outcome)
        ended = time.strftime("%Y-%m-%dT%H:%M:%S", time.gmtime())
        with self.path.open("a") as file:
            file.write(f"{outcome}\t{ended}\t{self.seconds.pop(report.nodeid):.1f}\t{report.nodeid}\n")


class Continued:
    """The hooks of the process that leads."""

    def __init__(self, record: Record) -> None:
        """Continue what a record tells of."""
        self._record = record

    @pytest.hookimpl(optionalhook=True)
    def pytest_configure_node(self, node: Any) -> None:
        """Tell a worker of xdist which tests have passed."""
        node.workerinput[SHARED] = self._record.passed()

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        """Count a part of a test."""
        self._record.take(report)

    @pytest.hookimpl(trylast=True)
    def pytest_sessionfinish(self, session: pytest.Session, exitstatus: int) -> None:
        """Have passed, too, where nothing is left to do."""
        if exitstatus == pytest.ExitCode.NO_TESTS_COLLECTED and self._record.passed():
            session.exitstatus = pytest.ExitCode.OK

    def pytest_terminal_summary(self, terminalreporter: pytest.TerminalReporter) -> None:
        """Say how many have passed in all sittings, and which of them had failed before."""
        passed = self._record.passed()
        path = FOLDER / self._record.path.name
        terminalreporter.write_line(f"{len(passed)} have passed on these files so far: {path}")
        for test in passed:
            failures = self._record.outcomes[test].count("failed")
            if failures:
                terminalreporter.write_line(f"passed, but had failed {failures} x: {test}")


def pytest_configure(config: pytest.Config) -> None:
    """Find the record of these files, in the process that leads."""
    if hasattr(config, "workerinput"):
        config.stash[PASSED] = config.workerinput[SHARED]
        return
    record = Record(config.rootpath / FOLDER / f"{_digest(config.rootpath)}.tsv")
    record.path.parent.mkdir(parents=True, exist_ok=True)
    record.read()
    config.stash[PASSED] = record.passed()
    config.pluginmanager.register(Continued(record))


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Leave out what has passed."""
    passed = set(config.stash[PASSED])
    left_out = [item for item in items if item.nodeid in passed]
    items[:] = [item for item in items if item.nodeid not in passed]
    if left_out:
        config.hook.pytest_deselected(items=left_out)


def _digest(root: Path) -> str:
    """Return a digest of this Python and of every file of the project that git does not ignore."""
    listed = ["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"]
    names = subprocess.run(listed, cwd=root, check=True, capture_output=True).stdout.split(b"\0")
    digest = hashlib.sha256(sys.version.encode())
    for name in sorted(set(names)):
        path = root / name.decode()
        content = path.read_bytes() if name and path.is_file() else b""
        digest.update(name + b"\0" + hashlib.sha256(content).digest())
    return digest.hexdigest()[:16]
