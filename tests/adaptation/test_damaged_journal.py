"""A journal that was damaged while nobody looked loses lines, and never the truth of what runs."""

from __future__ import annotations

import itertools
import random
import shutil
import sqlite3
from contextlib import closing
from pathlib import Path

import pytest

from regraft.adaptation_manager.execution import transaction
from regraft.adaptation_manager.execution.verify import verify
from regraft.adaptation_manager.journal.opening import HOW_LOST
from regraft.adaptation_manager.targets.component_client import ControlFailed
from regraft.bus_schema.encoding import codec
from regraft.bus_schema.keys import Keys
from regraft.bus_schema.messages.management.manager import ArchitectureRequest
from regraft.bus_schema.messages.protocol.control import ParameterValues
from regraft.bus_schema.model.adaptation import AdaptationReport, Outcome, SetParameters
from regraft.bus_schema.model.architecture import Architecture
from tests.adaptation.failures.test_recovery import dying
from tests.adaptation.system import System
from tests.support.waiting import PATIENCE, wait_until

COPIES = itertools.count()


def _set(system: System, gain: float) -> AdaptationReport:
    report = system.adapt(SetParameters("listener", {"gain": gain}))
    assert report.outcome is Outcome.APPLIED
    return report


def _architecture(system: System, revision: int | None = None) -> Architecture:
    return system.client.call("adaptation_manager/architecture", ArchitectureRequest(revision), Architecture, PATIENCE)


def _copy(system: System) -> Path:
    """Return a copy of the journal as a manager that is killed now would leave it."""
    copy = system.journal.with_name(f"copy-{next(COPIES)}.sqlite")
    for side in ("", "-wal"):
        if Path(f"{system.journal}{side}").exists():
            shutil.copyfile(f"{system.journal}{side}", f"{copy}{side}")
    return copy


def _settle(journal: Path) -> sqlite3.Connection:
    """Open a journal with everything in the file itself."""
    database = sqlite3.connect(journal, isolation_level=None)
    database.execute("PRAGMA wal_checkpoint(TRUNCATE)")
    return database


def _return(system: System, journal: Path) -> None:
    """Have the next manager take over with another journal than the one that the last one left."""
    system.running["manager"].kill()
    system.journal = journal
    system.start_manager()


def _said(system: System, kind: str) -> list[str]:
    return [event.text for event in system.events if event.kind == kind]


def test_what_was_told_to_be_applied_stays_if_its_line_is_cut_off(system: System) -> None:
    _set(system, 0.1)
    before = _copy(system)
    last = _set(system, 0.2)
    _return(system, before)
    now = _architecture(system)
    assert now.components["listener"].parameters["gain"] == 0.2
    assert now.revision == last.revision_after
    assert "begins anew at revision 3" in _said(system, "journal.lost")[0]
    stale = system.adapt(SetParameters("listener", {"gain": 0.9}), revision=2)
    assert stale.outcome is Outcome.REJECTED
    following = _set(system, 0.3)
    assert following.revision_after == 4
    assert int(following.id) > int(last.id)
    assert system.undo(following.id).outcome is Outcome.APPLIED
    assert system.view("listener").parameters["gain"] == 0.2


def test_an_undo_of_what_the_journal_has_lost_is_refused_with_why(system: System) -> None:
    first = _set(system, 0.1)
    before = _copy(system)
    _set(system, 0.2)
    _return(system, before)
    report = system.undo(first.id)
    assert report.outcome is Outcome.REJECTED
    assert "the journal was damaged" in report.violations[0].problem


def test_an_adaptation_whose_end_alone_is_cut_off_was_applied(system: System, monkeypatch: pytest.MonkeyPatch) -> None:
    copies = []
    real = verify

    async def copying(*arguments: object) -> None:
        await real(*arguments)  # type: ignore[arg-type]
        copies.append(_copy(system))

    with monkeypatch.context() as patch:
        patch.setattr("regraft.adaptation_manager.execution.transaction.verify", copying)
        report = _set(system, 0.2)
    _return(system, copies[0])
    assert system.view("listener").parameters["gain"] == 0.2
    assert _architecture(system).components["listener"].parameters["gain"] == 0.2
    (line,) = system.lines(id=report.id).entries
    assert (line.outcome, line.revision_after) == (Outcome.APPLIED, report.revision_after)
    assert _said(system, "journal.damaged") == [f"adaptation {report.id} was applied: {line.error}"]
    assert system.undo(report.id).outcome is Outcome.APPLIED
    assert "gain" not in system.view("listener").parameters or system.view("listener").parameters["gain"] != 0.2


def test_one_that_was_undone_is_not_taken_for_the_one_that_was_applied_after_it(
    system: System, monkeypatch: pytest.MonkeyPatch
) -> None:
    copies = []

    async def failing(*_: object) -> None:
        copies.append(_copy(system))
        raise ControlFailed("it does not want to")

    with monkeypatch.context() as patch:
        patch.setattr("regraft.adaptation_manager.execution.transaction.verify", failing)
        undone = system.adapt(SetParameters("listener", {"gain": 0.7}))
        assert undone.outcome is Outcome.ROLLED_BACK
    applied = _set(system, 0.2)
    assert applied.revision_after == 2, "it has the revision that the other would have had"
    _return(system, copies[0])
    assert _architecture(system).components["listener"].parameters["gain"] == 0.2
    assert _architecture(system).revision == applied.revision_after
    assert system.view("listener").parameters["gain"] == 0.2
    (line,) = system.lines(id=undone.id).entries
    assert (line.outcome, line.error) == (Outcome.STUCK, HOW_LOST)


def test_what_was_open_when_the_journal_begins_anew_is_not_undone(
    system: System, monkeypatch: pytest.MonkeyPatch
) -> None:
    _set(system, 0.1)
    copies = []

    async def copying(*_: object) -> None:
        copies.append(_copy(system))

    with monkeypatch.context() as patch:
        patch.setattr("regraft.adaptation_manager.execution.transaction.verify", copying)
        _set(system, 0.2)
    _set(system, 0.3)
    with closing(_settle(copies[0])) as database:
        database.execute("DELETE FROM runs")
    _return(system, copies[0])
    assert _architecture(system).components["listener"].parameters["gain"] == 0.3
    assert system.view("listener").parameters["gain"] == 0.3


@pytest.mark.parametrize("field", ["report", "following", "reason", "outcome"])
def test_a_changed_line_of_what_was_applied_is_set_aside_and_the_rest_goes_on(system: System, field: str) -> None:
    _set(system, 0.1)
    last = _set(system, 0.2)
    newest = system.adapt(SetParameters("fragile", {"level": 3}))
    journal = _copy(system)
    with closing(_settle(journal)) as database:
        _flip(database, field, int(last.id))
    _return(system, journal)
    components = _architecture(system).components
    assert f"adaptation {last.id}" in _said(system, "journal.damaged")[0]
    assert components["listener"].parameters["gain"] == 0.2
    assert components["fragile"].parameters["level"] == 3
    assert _architecture(system).revision > newest.revision_after
    assert _set(system, 0.4).outcome is Outcome.APPLIED
    numbers = [int(line.id) for line in system.lines(limit=100).entries]
    assert int(last.id) not in numbers
    assert len(numbers) == len(set(numbers))


def _flip(database: sqlite3.Connection, field: str, number: int) -> None:
    (value,) = database.execute(f"SELECT {field} FROM adaptations WHERE number = ?", (number,)).fetchone()
    flipped = value[:-1] + (b"\x00" if isinstance(value, bytes) else "?")
    database.execute(f"UPDATE adaptations SET {field} = ? WHERE number = ?", (flipped, number))


def test_a_changed_line_that_gave_nothing_costs_no_revision(system: System) -> None:
    rejected = system.adapt(SetParameters("listener", {"gain": "loud"}))
    last = _set(system, 0.2)
    journal = _copy(system)
    with closing(_settle(journal)) as database:
        _flip(database, "report", int(rejected.id))
    _return(system, journal)
    assert _architecture(system).revision == last.revision_after
    assert not _said(system, "journal.lost")
    assert system.lines(id=rejected.id).entries == ()
    assert system.undo(last.id).outcome is Outcome.APPLIED


def test_a_line_that_changes_while_the_manager_runs_is_left_out_and_told(system: System) -> None:
    first, last = _set(system, 0.1), _set(system, 0.2)
    with closing(_settle(system.journal)) as database:
        _flip(database, "report", int(first.id))
    assert [line.id for line in system.lines().entries] == [last.id, "1"]
    wait_until(lambda: _said(system, "journal.damaged"), "it to be told")
    tried = system.adapt(SetParameters("listener", {"gain": 0.3}), dry_run=True)
    assert (tried.outcome, tried.violations) == (Outcome.PENDING, ())
    assert _set(system, 0.3).revision_after == last.revision_after + 1
    with closing(sqlite3.connect(system.journal)) as database:
        assert database.execute("SELECT origin, number FROM damaged").fetchall() == [("adaptations", int(first.id))]


@pytest.mark.parametrize("how", ["deleted", "without what was written ahead", "replaced"])
def test_a_file_that_is_not_there_any_more_is_written_again(system: System, how: str) -> None:
    first = _set(system, 0.1)
    ahead = Path(f"{system.journal}-wal")
    if how != "without what was written ahead":
        system.journal.unlink()
    ahead.unlink()
    if how == "replaced":
        system.journal.write_text("somebody else's file")
    last = _set(system, 0.2)
    assert len(_said(system, "journal.replaced")) == 1
    _return(system, _copy(system))
    assert {first.id, last.id} <= {line.id for line in system.lines().entries}
    assert system.undo(last.id).outcome is Outcome.APPLIED
    assert not _said(system, "journal.lost")
    if how == "replaced":
        other = system.journal.parent / "journal.sqlite.replaced-1"
        assert other.read_text() == "somebody else's file"


def test_a_damaged_step_of_what_was_interrupted_is_said_to_stand(
    system: System, monkeypatch: pytest.MonkeyPatch
) -> None:
    with monkeypatch.context() as patch:
        dying(patch, transaction, "perform", 2, "after")
        system.adapt(SetParameters("listener", {"gain": 0.2}), SetParameters("fragile", {"level": 3}), wait=False)
        wait_until(lambda: not system.running["manager"].thread.is_alive())
    journal = _copy(system)
    with closing(_settle(journal)) as database:
        database.execute("UPDATE steps SET plan = x'00' WHERE step = 1")
    system.journal = journal
    system.start_manager()
    line = system.lines().entries[0]
    assert line.outcome is Outcome.STUCK
    assert [step.state.value for step in line.steps] == ["undo_failed", "undone"]
    assert system.view("fragile").parameters["level"] != 3


def test_a_component_that_is_not_as_the_architecture_says_is_told_of(system: System) -> None:
    _set(system, 0.1)
    running = system.running["listener"].runtime
    key = Keys("t").control("listener", running.assignment.incarnation, "parameters")
    values = codec.encode(ParameterValues({"gain": 0.9}, system.host.term, 2))
    (answer,) = system.running["second"].bus.query(key, values, PATIENCE)
    assert not answer.error
    _return(system, _copy(system))
    wait_until(lambda: _said(system, "architecture.differs"), "it to be told")
    assert "parameters.gain is 0.9, should be 0.1" in _said(system, "architecture.differs")[0]


@pytest.mark.parametrize("seed", range(12))
def test_wherever_it_is_damaged_what_runs_is_what_the_architecture_says(system: System, seed: int) -> None:
    damage_and_return(system, random.Random(seed))


def damage_and_return(system: System, chance: random.Random) -> None:
    """Adapt, damage the journal, have the next manager take over with it, and check all that must be so."""
    told = [_set(system, 0.1 + chance.random() / 2) for _ in range(8)]
    journal = _copy(system)
    if chance.random() < 0.5:
        _settle(journal).close()
    for _ in range(chance.randint(1, 4)):
        _damage(chance.choice([path for path in (journal, Path(f"{journal}-wal")) if path.exists()]), chance)
    _return(system, journal)
    now = _architecture(system)
    assert now.components["listener"].parameters["gain"] == system.view("listener").parameters["gain"]
    assert now.revision >= told[-1].revision_after
    following = _set(system, 0.05)
    assert following.revision_after > now.revision
    assert following.id not in {report.id for report in told}
    assert system.lines(limit=100).entries[0].id == following.id
    dry = system.adapt(SetParameters("listener", {"gain": 0.3}), dry_run=True)
    assert (dry.outcome, dry.violations) == (Outcome.PENDING, ())


def _damage(path: Path, chance: random.Random) -> None:
    held = bytearray(path.read_bytes())
    if not held:
        return
    if chance.random() < 0.3:
        del held[chance.randrange(len(held)) :]
    else:
        held[chance.randrange(len(held))] ^= 1 << chance.randrange(8)
    path.write_bytes(held)
