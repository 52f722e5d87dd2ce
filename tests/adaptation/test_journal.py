"""The journal: who, why, what, and what became of it."""

from __future__ import annotations

import contextlib
import itertools
import sqlite3
import threading
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager
from pathlib import Path

import pytest

from regraft import CallFailed, RefusalCode
from regraft.adaptation_manager.journal import architecture_store, write_back
from regraft.adaptation_manager.journal.journal import Journal, JournalError
from regraft.adaptation_manager.journal.opening import opened
from regraft.adaptation_manager.journal.write_back import WriteBack
from regraft.bus_schema.messages.management.manager import ArchitectureRequest
from regraft.bus_schema.messages.protocol.control import SetTransition
from regraft.bus_schema.messages.protocol.host import JournalEnd
from regraft.bus_schema.model.adaptation import Outcome, SetParameters
from regraft.bus_schema.model.architecture import Architecture
from regraft.bus_schema.model.lifecycle import Transition
from tests.adaptation.system import System
from tests.support.waiting import PATIENCE, wait_until


def test_the_stacks_start_is_the_first_line(system: System) -> None:
    (line,) = system.lines().entries
    assert (line.id, line.outcome, line.revision_after, line.request.changes) == ("1", Outcome.APPLIED, 1, ())


def test_lines_come_newest_first_and_in_pages(system: System) -> None:
    for level in range(1, 6):
        system.adapt(SetParameters("fragile", {"level": level}), actor="tester", reason=f"level {level}")
    page = system.lines(limit=4)
    assert [line.id for line in page.entries] == ["6", "5", "4", "3"]
    assert page.more
    assert page.entries[0].request.reason == "level 5"
    rest = system.lines(before="3")
    assert [line.id for line in rest.entries] == ["2", "1"]
    assert not rest.more
    assert system.lines(id="77").entries == ()


def test_the_same_key_is_the_same_adaptation(system: System) -> None:
    first = system.adapt(SetParameters("listener", {"gain": 0.1}), key="k1")
    assert system.adapt(SetParameters("listener", {"gain": 0.1}), key="k1") == first
    assert system.view("listener").revision == 2
    with pytest.raises(CallFailed, match="idempotency key"):
        system.adapt(SetParameters("listener", {"gain": 0.2}), key="k1")


def test_the_same_key_is_the_same_adaptation_across_a_restart_of_the_manager(system: System) -> None:
    first = system.adapt(SetParameters("listener", {"gain": 0.1}), key="k1")
    system.running["manager"].kill()
    system.start_manager()
    assert system.adapt(SetParameters("listener", {"gain": 0.1}), key="k1") == first


@contextmanager
def _returning_locked_out(system: System) -> Iterator[None]:
    """Kill the manager, and have the next one come up while somebody else holds the journal's lock."""
    system.running["manager"].kill()
    with closing(sqlite3.connect(system.journal, isolation_level=None)) as other:
        other.execute("BEGIN IMMEDIATE")
        system.start_manager()
        with pytest.raises(CallFailed, match="database is locked"):
            system.lines()
        yield
        other.execute("ROLLBACK")


@pytest.mark.parametrize("asked_before", [True, False])
def test_a_repeated_request_is_not_judged_without_the_journal(system: System, asked_before: bool) -> None:
    change = SetParameters("listener", {"gain": 0.1})
    first = system.adapt(change, key="k1")
    system.adapt(SetParameters("listener", {"gain": 0.2}))
    with _returning_locked_out(system):
        if asked_before:
            with pytest.raises(CallFailed, match="database is locked") as refused:
                system.adapt(change, key="k1")
            assert refused.value.code is RefusalCode.UNAVAILABLE
            assert system.adapt(change).outcome is Outcome.REJECTED
    assert system.adapt(change, key="k1") == first
    assert system.view("listener").parameters["gain"] == 0.2


def test_a_key_of_before_is_refused_for_another_request_once_the_journal_opens(system: System) -> None:
    system.adapt(SetParameters("listener", {"gain": 0.1}), key="k1")
    with _returning_locked_out(system):
        pass
    with pytest.raises(CallFailed, match="idempotency key") as refused:
        system.adapt(SetParameters("listener", {"gain": 0.3}), key="k1")
    assert refused.value.code is RefusalCode.KEY_REUSED
    assert system.view("listener").parameters["gain"] == 0.1


@pytest.mark.parametrize("wait", [True, False])
def test_a_request_with_a_key_opens_the_journal_again(system: System, wait: bool) -> None:
    with _returning_locked_out(system):
        pass
    report = system.adapt(SetParameters("listener", {"gain": 0.1}), key="k1", wait=wait)
    assert report.id
    assert system.adapt(SetParameters("listener", {"gain": 0.1}), key="k1").id == report.id
    assert [line.id for line in system.lines().entries] == [report.id, "1"]


def test_every_revision_can_be_read_again(system: System) -> None:
    for gain in (0.1, 0.2):
        system.adapt(SetParameters("listener", {"gain": gain}))

    def at(revision: int | None) -> Architecture:
        return system.client.call("adaptation_manager/architecture", ArchitectureRequest(revision), Architecture)

    gains = [at(revision).components["listener"].parameters.get("gain") for revision in (1, 2, 3, None)]
    assert gains == [None, 0.1, 0.2, 0.2]
    assert at(2).revision == 2
    with pytest.raises(CallFailed, match="no revision 9"):
        at(9)


def test_a_returning_manager_knows_the_architecture_of_its_run(system: System) -> None:
    system.adapt(SetParameters("listener", {"gain": 0.1}))
    system.running["manager"].kill()
    system.start_manager()
    report = system.adapt(SetParameters("listener", {"gain": 0.2}), revision=2)
    assert (report.id, report.outcome, report.revision_after) == ("3", Outcome.APPLIED, 3)


def test_a_new_run_begins_a_new_history_in_the_same_file(system: System) -> None:
    system.adapt(SetParameters("listener", {"gain": 0.1}))
    system.running["manager"].kill()
    system.host.run, system.host.term, system.host.revision, system.host.journal = "run-2", 0, 1, JournalEnd()
    system.start_manager()
    assert [line.id for line in system.lines().entries] == ["1"]


def test_a_full_journal_rejects_and_recovers(system: System, monkeypatch: pytest.MonkeyPatch) -> None:
    system.adapt(SetParameters("listener", {"gain": 0.1}))
    before = system.views()
    database = system.running["manager"].component._store.journal.database
    system.running["manager"].runtime.post(
        lambda: database.execute(f"PRAGMA max_page_count = {database.execute('PRAGMA page_count').fetchone()[0]}")
    )
    reports = [system.adapt(SetParameters("listener", {"gain": 0.3}), reason="x" * 1000) for _ in range(20)]
    assert reports[-1].outcome is Outcome.REJECTED
    assert "full" in reports[-1].violations[0].problem
    if all(report.outcome is Outcome.REJECTED for report in reports):
        assert system.views() == before
    system.running["manager"].runtime.post(lambda: database.execute("PRAGMA max_page_count = 1000000"))
    assert system.adapt(SetParameters("listener", {"gain": 0.4})).outcome is Outcome.APPLIED
    assert system.view("listener").parameters["gain"] == 0.4


def test_a_disk_that_fills_up_half_way_rolls_back(system: System, monkeypatch: pytest.MonkeyPatch) -> None:
    before = system.views()
    real = Journal.end

    def full(self: Journal, report: object) -> None:
        raise JournalError("database or disk is full")

    monkeypatch.setattr(Journal, "end", full)
    report = system.adapt(SetParameters("listener", {"gain": 0.3}))
    assert report.outcome is Outcome.ROLLED_BACK
    assert "disk is full" in report.error
    assert system.views() == before
    assert system.adapt(SetParameters("listener", {"gain": 0.3})).outcome is Outcome.REJECTED
    monkeypatch.setattr(Journal, "end", real)
    assert system.adapt(SetParameters("listener", {"gain": 0.3})).outcome is Outcome.APPLIED
    assert system.lines(id=report.id).entries[0].outcome is Outcome.ROLLED_BACK


def test_what_cannot_be_written_now_can_be_read_and_tried(system: System, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(self: Journal, report: object) -> None:
        raise JournalError("database or disk is full")

    monkeypatch.setattr(Journal, "end", full)
    report = system.adapt(SetParameters("listener", {"gain": 0.3}))
    assert system.adapt(SetParameters("listener", {"gain": 0.3})).outcome is Outcome.REJECTED
    assert system.lines(id=report.id).entries == (report,)
    assert system.lines(limit=1).more
    assert report in system.lines().entries
    tried = system.adapt(SetParameters("listener", {"gain": 0.3}), dry_run=True)
    assert (tried.outcome, tried.violations) == (Outcome.PENDING, ())


def test_a_journal_that_cannot_be_used_after_a_restart_is_told_of_as_it_is(
    system: System, monkeypatch: pytest.MonkeyPatch
) -> None:
    system.adapt(SetParameters("listener", {"gain": 0.1}))
    system.running["manager"].kill()

    def full(self: Journal) -> None:
        raise JournalError("database or disk is full")

    with monkeypatch.context() as patch:
        patch.setattr(Journal, "open_lines", full)
        system.start_manager()
        report = system.adapt(SetParameters("listener", {"gain": 0.3}))
        assert report.outcome is Outcome.REJECTED
        assert "disk is full" in report.violations[0].problem
        with pytest.raises(CallFailed, match="disk is full"):
            system.lines()
    assert system.adapt(SetParameters("listener", {"gain": 0.3})).outcome is Outcome.APPLIED


@pytest.mark.parametrize("given", ["9223372036854775808", "1" * 200, "\u0663", "+2", "-1"])
def test_what_is_no_id_is_refused(system: System, given: str) -> None:
    with pytest.raises(CallFailed, match="there is no adaptation"):
        system.lines(before=given)
    assert system.lines(id=given).entries == ()


def test_without_its_journal_a_run_goes_on_with_its_revision_and_that_is_said(system: System) -> None:
    for gain in (0.1, 0.2, 0.3):
        last = system.adapt(SetParameters("listener", {"gain": gain}))
    system.running["manager"].kill()
    for file in system.journal.parent.glob(f"{system.journal.name}*"):
        file.unlink()
    system.start_manager()
    report = system.adapt(SetParameters("listener", {"gain": 0.4}))
    assert (report.revision_before, report.revision_after) == (last.revision_after, last.revision_after + 1)
    assert int(report.id) > int(last.id)
    assert system.view("listener").parameters["gain"] == 0.4
    (lost,) = [event for event in system.events if event.kind == "journal.lost"]
    assert "begins anew at revision 4" in lost.text


def test_a_corrupt_journal_is_set_aside_and_said(bare_system: System) -> None:
    bare_system.journal.write_bytes(b"this is no database at all, whatever its name says" * 100)
    bare_system.start_manager()
    assert bare_system.adapt(SetParameters("listener", {"gain": 0.3})).outcome is Outcome.APPLIED
    assert Path(f"{bare_system.journal}.corrupt-1").exists()
    wait_until(lambda: [event for event in bare_system.events if event.kind == "journal.corrupt"])


def test_a_journal_that_cannot_be_opened_rejects_and_recovers(bare_system: System) -> None:
    place = bare_system.journal.parent / "taken"
    place.write_text("a file where a folder should be")
    bare_system.journal = place / "journal.sqlite"
    bare_system.start_manager()
    report = bare_system.adapt(SetParameters("listener", {"gain": 0.3}))
    assert report.outcome is Outcome.REJECTED
    assert "cannot be opened" in report.violations[0].problem
    place.unlink()
    assert bare_system.adapt(SetParameters("listener", {"gain": 0.3})).outcome is Outcome.APPLIED


def test_what_was_written_ahead_goes_into_the_file(system: System, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(write_back, "WRITE_BACK_TIMEOUT", 20)
    gain = itertools.cycle((0.1, 0.2))

    def bytes_in_the_file_itself() -> int:
        assert system.adapt(SetParameters("listener", {"gain": next(gain)})).outcome is Outcome.APPLIED
        return system.journal.stat().st_size

    before = bytes_in_the_file_itself()
    wait_until(lambda: bytes_in_the_file_itself() > before + 20_000)


def test_what_is_written_ahead_stays_short_although_the_thread_never_catches_up(
    bare_system: System, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(WriteBack, "if_due", lambda self: None)
    monkeypatch.setattr(write_back, "TOO_LONG", 50)
    bare_system.start_manager()
    ahead = Path(f"{bare_system.journal}-wal")
    for gain in itertools.islice(itertools.cycle((0.1, 0.2)), 100):
        assert bare_system.adapt(SetParameters("listener", {"gain": gain})).outcome is Outcome.APPLIED
        assert ahead.stat().st_size < 100 * 4200


def test_a_disk_that_is_slow_to_write_back_keeps_no_adaptation_waiting(
    system: System, monkeypatch: pytest.MonkeyPatch
) -> None:
    begun, done = threading.Event(), threading.Event()

    def slow(self: WriteBack) -> None:
        begun.set()
        assert done.wait(PATIENCE)

    monkeypatch.setattr(write_back, "WRITE_BACK_TIMEOUT", 1)
    monkeypatch.setattr(WriteBack, "_write_back", slow)
    assert system.adapt(SetParameters("listener", {"gain": 0.1})).outcome is Outcome.APPLIED
    assert begun.wait(PATIENCE)
    assert system.adapt(SetParameters("listener", {"gain": 0.2})).outcome is Outcome.APPLIED
    assert [line.id for line in system.lines().entries] == ["3", "2", "1"]
    done.set()


def test_a_failed_write_back_is_in_the_log_and_loses_nothing(
    system: System, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    assert system.adapt(SetParameters("listener", {"gain": 0.1})).outcome is Outcome.APPLIED
    monkeypatch.setattr(write_back, "WRITE_BACK_TIMEOUT", 1)
    monkeypatch.setattr(system.running["manager"].component._store.journal.write_back, "_path", "/nowhere/at/all")
    assert system.adapt(SetParameters("listener", {"gain": 0.2})).outcome is Outcome.APPLIED
    wait_until(lambda: "cannot be written back" in caplog.text)
    assert [line.id for line in system.lines().entries] == ["3", "2", "1"]


def test_a_manager_that_is_deactivated_while_its_journal_opens_leaves_it_closed(
    bare_system: System, monkeypatch: pytest.MonkeyPatch
) -> None:
    opening, go_on = threading.Event(), threading.Event()

    def opened_late(path: str, tell: Callable[[str, str], None]) -> Journal:
        journal = opened(path, tell)
        opening.set()
        assert go_on.wait(PATIENCE)
        return journal

    monkeypatch.setattr(architecture_store, "opened", opened_late)
    bare_system.start_manager()
    assert opening.wait(PATIENCE)
    bare_system.client.control("manager", "transition", SetTransition(Transition.DEACTIVATE))
    assert _open_files(bare_system.journal)
    go_on.set()
    wait_until(lambda: not _open_files(bare_system.journal), "the journal is closed")


def _open_files(path: Path) -> list[str]:
    found = []
    for descriptor in Path("/proc/self/fd").iterdir():
        with contextlib.suppress(FileNotFoundError):
            found.append(str(descriptor.readlink()))
    return [name for name in found if name.startswith(str(path))]
