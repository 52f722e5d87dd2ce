"""A long journal keeps some architectures whole: what is read from there on is what all lines would give."""

from __future__ import annotations

import sqlite3
from collections.abc import Iterator
from contextlib import closing, contextmanager

import pytest

from regraft import CallFailed
from regraft.adaptation_manager.execution import undo_changes
from regraft.adaptation_manager.journal import revisions
from regraft.bus_schema.messages.management.manager import ArchitectureRequest
from regraft.bus_schema.model.adaptation import Outcome, SetParameters
from regraft.bus_schema.model.architecture import Architecture
from tests.adaptation.system import System
from tests.support.waiting import PATIENCE, wait_until

KEEP_EVERY = 5
LAST = 24


@pytest.fixture(autouse=True)
def _keep_often(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(revisions, "KEEP_EVERY", KEEP_EVERY)


def _lengthen(system: System) -> None:
    """Make revisions up to ``LAST``."""
    for n in range(2, LAST + 1):
        assert system.adapt(SetParameters("listener", {"gain": n / 100})).outcome is Outcome.APPLIED


def _at(system: System, revision: int | None = None) -> Architecture:
    return system.client.call("adaptation_manager/architecture", ArchitectureRequest(revision), Architecture, PATIENCE)


def _gain(system: System, revision: int) -> object:
    return _at(system, revision).components["listener"].parameters["gain"]


@contextmanager
def _opened(system: System) -> Iterator[sqlite3.Connection]:
    with closing(sqlite3.connect(system.journal, isolation_level=None)) as database:
        yield database


def _damage_line(system: System, revision: int) -> None:
    with _opened(system) as database:
        database.execute("UPDATE adaptations SET following = x'00' WHERE revision = ?", (revision,))


def _kept(system: System) -> list[int]:
    with _opened(system) as database:
        return [revision for (revision,) in database.execute("SELECT revision FROM architectures ORDER BY revision")]


def _restart(system: System) -> None:
    system.running["manager"].kill()
    system.start_manager()


def _said(system: System, kind: str) -> list[str]:
    return [event.text for event in system.events if event.kind == kind]


def test_every_revision_is_the_same_with_whole_architectures_and_without(system: System) -> None:
    _lengthen(system)
    assert _kept(system) == [5, 10, 15, 20]
    found = [_at(system, revision) for revision in range(1, LAST + 1)]
    with _opened(system) as database:
        database.execute("DELETE FROM architectures")
    assert [_at(system, revision) for revision in range(1, LAST + 1)] == found
    assert [architecture.revision for architecture in found] == list(range(1, LAST + 1))


def test_a_returning_manager_reads_no_line_before_the_last_whole_architecture(system: System) -> None:
    _lengthen(system)
    _damage_line(system, 19)
    _restart(system)
    assert _gain(system, LAST) == LAST / 100
    wait_until(lambda: _said(system, "journal.damaged"))
    assert not _said(system, "journal.lost")
    assert system.adapt(SetParameters("listener", {"gain": 0.9})).revision_after == LAST + 1


def test_an_undo_reads_no_line_before_the_last_whole_architecture(system: System) -> None:
    _lengthen(system)
    _damage_line(system, 19)
    undone = system.undo(system.lines(limit=1).entries[0].id)
    assert undone.outcome is Outcome.APPLIED
    assert system.view("listener").parameters["gain"] == (LAST - 1) / 100


def test_an_undo_is_compared_with_the_newest_adaptations_alone(system: System, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(undo_changes, "MAX_LATER", 3)
    early = system.adapt(SetParameters("second", {"gain": 0.9}))
    _lengthen(system)
    assert system.undo(early.id, dry_run=True).violations == (), "nobody has decided on it since"
    later = system.adapt(SetParameters("second", {"gain": 0.2}))
    (found,) = system.undo(early.id).violations
    assert f"was changed again by adaptation {later.id}: it is 0.2" in found.problem
    for n in range(3):
        system.adapt(SetParameters("listener", {"gain": n / 10}))
    (found,) = system.undo(early.id).violations
    assert "was changed again by an adaptation before the last 3: it is 0.2" in found.problem


@pytest.mark.parametrize("revision", [2**62, 2**63, 2**64 - 1])
def test_a_revision_that_can_never_be_is_not_found(system: System, revision: int) -> None:
    with pytest.raises(CallFailed, match=f"no revision {revision}"):
        _at(system, revision)


def test_a_damaged_line_hides_what_leads_on_from_it_up_to_the_next_whole_architecture(system: System) -> None:
    _lengthen(system)
    _damage_line(system, 12)
    assert _gain(system, 11) == 11 / 100
    for hidden in (12, 13, 14):
        with pytest.raises(CallFailed, match=f"no revision {hidden}"):
            _at(system, hidden)
    assert _gain(system, 15) == 15 / 100


def test_a_damaged_whole_architecture_is_passed_over(system: System) -> None:
    _lengthen(system)
    with _opened(system) as database:
        database.execute("UPDATE architectures SET architecture = x'00' WHERE revision >= 15")
    assert _gain(system, 23) == 23 / 100
    _restart(system)
    assert _gain(system, 23) == 23 / 100
    assert not _said(system, "journal.lost")


def test_a_run_that_begins_again_reads_nothing_kept_before(system: System) -> None:
    _lengthen(system)
    _damage_line(system, LAST)
    _restart(system)
    wait_until(lambda: _said(system, "journal.lost"))
    assert f"begins anew at revision {LAST}" in _said(system, "journal.lost")[0]
    with pytest.raises(CallFailed, match="no revision 20"):
        _at(system, 20)
    assert _at(system).components["listener"].parameters["gain"] == LAST / 100
    assert system.adapt(SetParameters("listener", {"gain": 0.9})).outcome is Outcome.APPLIED
    assert _gain(system, LAST + 1) == 0.9


def test_a_full_disk_keeps_no_architecture_and_rejects_nothing_for_that(system: System) -> None:
    assert system.lines().entries
    with _opened(system) as database:
        database.execute(
            "CREATE TRIGGER full BEFORE INSERT ON architectures BEGIN SELECT raise(ABORT, 'disk is full'); END"
        )
    _lengthen(system)
    assert _kept(system) == []
    with _opened(system) as database:
        database.execute("DROP TRIGGER full")
    assert system.adapt(SetParameters("listener", {"gain": 0.9})).outcome is Outcome.APPLIED
    assert _kept(system) == [LAST + 1]
