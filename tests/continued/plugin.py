"""Evidence in several sittings: what has passed on the very same files is not run again.

Loaded by ``pytest -p tests.continued.plugin``. Each beginning and each outcome is a line of
``build/evidence/DIGEST.tsv``. The digest is of every file of the project that git does not ignore, and of the versions
that a run depends on. A change of any of them begins anew.
"""

from __future__ import annotations

import hashlib
import json
import subprocess
import time
from collections import defaultdict
from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pytest

from regraft.evaluation.runs.fingerprint import versions

FOLDER = Path("build/evidence")
PASSED = pytest.StashKey[Iterable[str]]()
SHARED = "passed_before"
"""Under this name the workers of xdist are told of the tests that have passed, so that all collect the same."""


BEGUN = "begun"
"""The outcome of a test so far that is under way, or was cut off: its process may have been killed with it."""


@dataclass
class Record:
    """The outcomes of all sittings on the same files, and the reports on parts of tests that are under way."""

    path: Path
    outcomes: dict[str, list[str]] = field(default_factory=lambda: defaultdict(list))
    reports: dict[str, list[pytest.TestReport]] = field(default_factory=lambda: defaultdict(list))

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

    def attempts(self, test: str) -> int:
        """Return how often a test was begun."""
        return self.outcomes[test].count(BEGUN)

    def begin(self, test: str) -> None:
        """Note that a test begins."""
        self._note(test, BEGUN, 0.0)

    def take(self, report: pytest.TestReport) -> None:
        """Take the report on one part of a test: its set-up, its call or its end; note its outcome at its end."""
        self.reports[report.nodeid].append(report)
        if report.when == "teardown":
            parts = self.reports.pop(report.nodeid)
            found = {part.outcome for part in parts}
            outcome = next(outcome for outcome in ("failed", "skipped", "passed") if outcome in found)
            self._note(report.nodeid, outcome, sum(part.duration for part in parts))

    def _note(self, test: str, outcome: str, seconds: float) -> None:
        self.outcomes[test].append(outcome)
        now = time.strftime("%Y-%m-%dT%H:%M:%S", time.gmtime())
        with self.path.open("a") as file:
            file.write(f"{outcome}\t{now}\t{seconds:.1f}\t{test}\n")


class Continued:
    """The hooks of the process that leads."""

    def __init__(self, record: Record) -> None:
        """Continue what a record tells of."""
        self._record = record

    @pytest.hookimpl(optionalhook=True)
    def pytest_configure_node(self, node: Any) -> None:
        """Tell a worker of xdist which tests have passed."""
        node.workerinput[SHARED] = self._record.passed()

    def pytest_runtest_logstart(self, nodeid: str) -> None:
        """Note that a test begins."""
        self._record.begin(nodeid)

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        """Count a part of a test."""
        self._record.take(report)

    @pytest.hookimpl(trylast=True)
    def pytest_sessionfinish(self, session: pytest.Session, exitstatus: int) -> None:
        """Have passed, too, where nothing is left to do."""
        if exitstatus == pytest.ExitCode.NO_TESTS_COLLECTED and self._record.passed():
            session.exitstatus = pytest.ExitCode.OK

    def pytest_terminal_summary(self, terminalreporter: pytest.TerminalReporter) -> None:
        """Say how many have passed in all sittings, and which of them not at the first attempt."""
        passed = self._record.passed()
        path = FOLDER / self._record.path.name
        terminalreporter.write_line(f"{len(passed)} have passed on these files so far: {path}")
        for test in passed:
            if (attempts := self._record.attempts(test)) > 1:
                terminalreporter.write_line(f"passed at attempt {attempts}: {test}")


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
    """Return a digest of every file of the project that git does not ignore, and of what a run depends on."""
    listed = ["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"]
    try:
        names = subprocess.run(listed, cwd=root, check=True, capture_output=True).stdout.split(b"\0")
    except (OSError, subprocess.CalledProcessError) as error:
        raise pytest.UsageError(f"git has to list the files that evidence is about: {error}") from None
    digest = hashlib.sha256(json.dumps(versions(), sort_keys=True).encode())
    for name in sorted({*names} - {b""}):
        path = root / name.decode()
        if path.is_file():
            digest.update(name + b"\0" + hashlib.sha256(path.read_bytes()).digest())
    return digest.hexdigest()[:16]
