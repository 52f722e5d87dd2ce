"""The folder of a run holds what is kept of it, and a run that cannot be kept is told with its causes."""

from __future__ import annotations

import os
import sqlite3
from collections.abc import Mapping
from contextlib import closing as closing_after
from pathlib import Path
from typing import Any

import pytest

from regraft.bus_schema.encoding import codec
from regraft.bus_schema.model.adaptation import (
    AdaptationReport,
    AdaptationRequest,
    ChangeState,
    Outcome,
    Phase,
    PhaseReport,
    StepReport,
    StepState,
)
from regraft.bus_schema.model.lifecycle import Transition
from regraft.evaluation.results.recording import digest_of
from regraft.evaluation.rows import OVER
from regraft.evaluation.runs.attempts import INCOMPLETE
from regraft.evaluation.runs.fingerprint import Fingerprint, files_in
from regraft.evaluation.runs.run_directory import BadRun, Plan, complete, prepare, read_run
from regraft.evaluation.study import Changes, variant
from regraft.stack import plain_document
from tests.evaluation.tiny import STUDY

MADE_OF = Fingerprint("a" * 64, {}, "b" * 64, "c" * 64, 1, 4.0)
CLOSING = {"system": "tiny", "reproducible": True, "restarts": 0, "causes": []}
ENDED = {"code": "ended", "component": "counter", "text": "counter ended"}
HEADER = "time,number\n"
ROWS = "".join(f"{number},{number}\n" for number in range(1, 5))


SCALARS = """\
system: scalars
components:
  lamp:
    command: [lamp, on, off, 12:30, 1_000, 010, 0o17, 0x1F, 1e-3, .5, '1e5', '0o17', '.inf', "null", 'on', 2026-11-30]
    parameters: {low: 1e-3, large: 1e300, text: '1e5', far: '1e999', empty: '', nothing: null, lines: "a\\n1\\n"}
modes:
  on: [{change: set_parameters, component: lamp, parameters: {text: y}}]
  off: [{change: set_parameters, component: lamp, parameters: {text: 'true'}}]
"""
"""Scalars that other versions of YAML read otherwise."""


def plan(stack: Path = STUDY.stack, changes: Changes = STUDY.additions) -> Plan:
    return Plan(STUDY.name, "plain", STUDY.configurations["plain"][0], 1, 1, 4.0, stack, (changes,))


def finished(home: Path, rows: str = HEADER + ROWS) -> Path:
    """Make the folder of a run that has just ended."""
    (home / "tiny" / "logs").mkdir(parents=True)
    (home / "tiny" / "rows.csv").write_text(rows)
    return home


def causes(home: Path, closing: Mapping[str, Any]) -> list[str]:
    """Return the codes of the causes by which a run is not kept."""
    with pytest.raises(BadRun) as failed:
        complete(plan(), home, closing, MADE_OF)
    return [cause.code for cause in failed.value.causes]


def test_a_run_whose_parts_a_schedule_ended_is_kept(tmp_path: Path) -> None:
    complete(plan(), finished(tmp_path), CLOSING | {"restarts": 3}, MADE_OF)
    assert (tmp_path / "run.json").is_file()


def test_a_run_whose_parts_ended_by_themselves_is_not_kept(tmp_path: Path) -> None:
    assert causes(finished(tmp_path), CLOSING | {"restarts": 1, "causes": [ENDED]}) == ["ended"]


def test_a_stack_is_run_as_its_file_means_it(tmp_path: Path) -> None:
    file = tmp_path / "stack" / "stack.yaml"
    file.parent.mkdir()
    file.write_text(SCALARS)
    whole = plain_document(file)
    assert whole["components"]["lamp"]["command"][:5] == ["lamp", "on", "off", "12:30", "1_000"]
    assert plain_document(prepare(plan(file, {}), tmp_path / "run")) == whole
    assert plain_document(prepare(plan(STUDY.stack, variant(file)), tmp_path / "changed"))["modes"] == whole["modes"]


def test_what_is_no_file_beside_a_stack_is_left_out(tmp_path: Path) -> None:
    folder = tmp_path / "stack"
    folder.mkdir()
    (folder / "stack.yaml").write_text(SCALARS)
    (folder / "missions").mkdir()
    (folder / "missions" / "main.xml").write_text("<root/>")
    (folder / "linked").symlink_to("missions")
    (folder / ".#stack.yaml").symlink_to("nobody@nowhere.1:1")  # as an editor has it while there are changes
    os.mkfifo(folder / "missions" / "queue")
    prepare(plan(folder / "stack.yaml", {}), tmp_path / "run")
    copied = {path.relative_to(tmp_path / "run" / "stack").as_posix() for path in (tmp_path / "run").rglob("*.*")}
    assert copied == {"stack.yaml", "as_run.yaml", "missions/main.xml", "linked/main.xml"}


def copied(folder: Path, run: Path) -> list[str]:
    """Return the names of the files that a run takes along, but for the stack as it is run."""
    prepare(plan(folder / "stack.yaml", {}), run)
    found = (path.relative_to(run / "stack").as_posix() for path in (run / "stack").rglob("*") if path.is_file())
    return sorted(name for name in found if name != "as_run.yaml")


def test_what_is_hidden_beside_a_stack_is_left_out(tmp_path: Path) -> None:
    folder = tmp_path / "stack"
    for name in (".venv/lib/big.so", ".git/HEAD", "missions/.backup/main.xml", "missions/main.xml", ".env"):
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text("")
    (folder / "stack.yaml").write_text(SCALARS)
    assert copied(folder, tmp_path / "run") == ["missions/main.xml", "stack.yaml"]


def test_links_in_a_circle_are_taken_along_once(tmp_path: Path) -> None:
    folder = tmp_path / "stack"
    folder.mkdir()
    (folder / "stack.yaml").write_text(SCALARS)
    (folder / "again").symlink_to(".")
    (folder / "itself").symlink_to("itself")
    assert copied(folder, tmp_path / "run") == ["stack.yaml"]
    for name, other in (("one", "other"), ("other", "one")):
        (folder / name).mkdir()
        (folder / name / "mission.xml").write_text(name)
        (folder / name / "link").symlink_to(folder / other)
    (folder / "one" / "up").symlink_to("..")
    counted = sorted(path.relative_to(folder).as_posix() for path in files_in(folder))
    assert copied(folder, tmp_path / "run") == counted
    assert len(counted) == 5


def adaptation(number: int, started: float, outcome: Outcome, watched: float | None = None) -> AdaptationReport:
    """Return the report of an adaptation that is watched for 3 s; ``watched`` is how long it was, if that is over."""
    request = AdaptationRequest((ChangeState("counter", Transition.DEACTIVATE),), "a test", "tests", confirm=3.0)
    phases = () if watched is None else (PhaseReport(Phase.CONFIRM, watched),)
    revision = number if outcome in (Outcome.ROLLED_BACK, Outcome.CANCELLED) else number + 1
    steps = (StepReport(1, "counter", "deactivate", StepState.UNDONE if revision == number else StepState.DONE),)
    return AdaptationReport(str(number), outcome, request, number, revision, started, phases=phases, steps=steps)


def ended_by_its_recorder(home: Path, *reports: AdaptationReport) -> tuple[str, str]:
    """Return the adaptations and the digest of a run whose last row is that of 4 s."""
    rows = "".join(f"{second},{second},{int(second == 4)}\n" for second in range(1, 5))
    finished(home, f"time,number,{OVER}\n{rows}")
    with closing_after(sqlite3.connect(home / "tiny" / "journal.sqlite")) as journal, journal:
        journal.execute("CREATE TABLE adaptations (number INTEGER, report BLOB)")
        lines = [(number, codec.encode(report)) for number, report in enumerate(reports)]
        journal.executemany("INSERT INTO adaptations VALUES (?, ?)", lines)
    complete(plan(), home, CLOSING, MADE_OF)
    return (home / "adaptations.csv").read_text(), digest_of(read_run(home, plan().configuration))


def test_a_confirmation_that_ends_after_the_last_row_is_under_way_whenever_the_run_was_ended(tmp_path: Path) -> None:
    undone = adaptation(1, 0.5, Outcome.ROLLED_BACK, 1.0)
    late = [
        adaptation(2, 2.0, Outcome.CONFIRMING),
        adaptation(2, 2.0, Outcome.APPLIED, 3.0),
        adaptation(2, 2.0, Outcome.ROLLED_BACK, 2.5),
        adaptation(2, 2.0, Outcome.CANCELLED, 2.0),
    ]
    found = {ended_by_its_recorder(tmp_path / str(number), undone, report) for number, report in enumerate(late)}
    ((text, _),) = found
    assert [line.split(",")[:2] for line in text.splitlines()[1:]] == [["0.5", "rolled_back"], ["2", "confirming"]]


def test_a_confirmation_that_ends_before_the_last_row_counts_as_it_ended(tmp_path: Path) -> None:
    applied = ended_by_its_recorder(tmp_path / "one", adaptation(1, 0.5, Outcome.APPLIED, 3.0))
    undone = ended_by_its_recorder(tmp_path / "other", adaptation(1, 0.5, Outcome.ROLLED_BACK, 3.0))
    assert "applied" in applied[0]
    assert "rolled_back" in undone[0]
    assert applied[1] != undone[1]


@pytest.mark.parametrize(
    "rows",
    [
        f"{HEADER}1,1\n2,3,3\n4,4\n",
        f"{HEADER}1,1\n23,3\n4,4\n",
        f"{HEADER}1,1\n2,2\nx,3\n4,4\n",
        f"tim1,1\n{ROWS}",
        "",
    ],
)
def test_a_run_whose_rows_are_broken_is_not_kept(tmp_path: Path, rows: str) -> None:
    assert causes(finished(tmp_path, rows), CLOSING) == [INCOMPLETE]
    assert not (tmp_path / "run.json").exists()
