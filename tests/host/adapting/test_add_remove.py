"""Components are added to and removed from a running system of real processes."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from regraft.bus_schema.messages.management.manager import JournalPage, JournalRequest, UndoAdaptation
from regraft.bus_schema.messages.protocol.control import Snapshot
from regraft.bus_schema.messages.protocol.host import ProcessState
from regraft.bus_schema.model.adaptation import AdaptationReport, AdaptationRequest, Add, Change, Outcome, Remove
from regraft.bus_schema.model.architecture import ComponentSpec, TopicSpec
from regraft.bus_schema.model.lifecycle import State
from tests.host.conftest import HEAD, Start
from tests.support.machine.processes import children_of, exists, kill
from tests.support.systems import System, all_ended, home
from tests.support.waiting import PATIENCE, wait_until

pytestmark = pytest.mark.slow

STACK = """\
  ticker: {class: 'tests.host.parts:Ticker'}
  adaptation_manager:
    class: regraft.adaptation_manager.manager:AdaptationManager
    parameters: {journal: $RUN/journal.sqlite, answer_within: 1.0, undo_within: 3.0, start_within: 10.0}
"""
TOPICS = """\
  ticks: {type: host_tests/Tick}
  adaptations: {type: regraft/AdaptationReport}
  architecture: {type: regraft/Architecture}
"""
ALL = HEAD.replace("  ticks: {type: host_tests/Tick}\n", TOPICS)
KEPT = {"ticker", "adaptation_manager"}
MORE, OTHERS = (TopicSpec(name, "host_tests/Tick") for name in ("more", "others"))
TICKER = ComponentSpec(cls="tests.host.parts:Ticker", connections={"ticks": "more"}, parameters={"step": 2})
OTHER = replace(TICKER, connections={"ticks": "others"})
LATE = '''\
"""A module that nobody has imported before it is needed."""

from regraft import Component, Parameter


class Late(Component):
    """Comes late."""

    prepared = False
    path = Parameter("", "a file", unit="path", read_only=True)
    needed = Parameter("", "a file that has to be there", unit="path", exists=True)

    @classmethod
    def preload(cls):
        cls.prepared = True

    def on_activate(self):
        assert self.prepared
        self.kit.set_status_text(self.path)
'''


@pytest.fixture(scope="module")
def shared(tmp_path_factory: pytest.TempPathFactory) -> Iterator[System]:
    """Return a ticker and a manager, and modules beside the stack that are not imported yet."""
    folder = tmp_path_factory.mktemp("adding")
    for module in ("late", "later"):
        (folder / f"{module}.py").write_text(LATE)
    (folder / "deadly_import.py").write_text("import os\nos._exit(7)\n")
    stack = folder / "stack.yaml"
    stack.write_text(ALL + STACK)
    with home(folder / "home"), all_ended() as started:
        started.append(System(stack))
        yield started[0]


@pytest.fixture
def running(shared: System) -> System:
    """Return the system once only the ticker and the manager run in it."""
    for name in sorted(_names(shared) - KEPT):
        assert _adapt(shared, Remove(name)).outcome is Outcome.APPLIED
    wait_until(lambda: _names(shared) == KEPT, "only the ticker and the manager to run")
    shared.wait_running("ticker")
    shared.wait_running("adaptation_manager")
    return shared


def _adapt(system: System, *changes: Change, **more: Any) -> AdaptationReport:
    request = AdaptationRequest(changes, **more)
    return system.client.call("adaptation_manager/adapt", request, AdaptationReport, PATIENCE)


def _undo(system: System, report: AdaptationReport) -> AdaptationReport:
    request = UndoAdaptation(report.id)
    return system.client.call("adaptation_manager/undo", request, AdaptationReport, PATIENCE)


def _names(system: System) -> set[str]:
    return set(system.processes())


def test_a_component_comes_and_goes_and_comes_back(running: System) -> None:
    before = children_of(running.process.pid)
    added = _adapt(running, Add("second", TICKER, (MORE,)))
    assert added.outcome is Outcome.APPLIED, added
    process = running.wait_running("second")
    view = running.client.view("second")
    assert (view.state, view.parameters["step"], view.connections) == (State.ACTIVE, 2, {"ticks": "more"})
    kill(process.pid)
    again = running.wait_running("second", 2)
    assert running.client.view("second").state is State.ACTIVE, "its host restarts it as any other"

    removed = _adapt(running, Remove("second"))
    assert removed.outcome is Outcome.APPLIED, removed
    assert not exists(again.pid)
    wait_until(lambda: _names(running) == KEPT)
    assert children_of(running.process.pid) == before
    assert running.said("component.removed", "second")
    assert not [event for event in running.said("component.restarted", "second") if "incarnation 3" in event.text]

    undone = _undo(running, removed)
    assert undone.outcome is Outcome.APPLIED, undone
    assert running.wait_running("second", 3).incarnation == 3
    assert running.client.view("second").parameters["step"] == 2


def test_undoing_a_removal_continues_from_the_last_checkpoint_and_a_fresh_addition_begins_anew(running: System) -> None:
    assert _adapt(running, Add("third", OTHER, (OTHERS,))).outcome is Outcome.APPLIED
    wait_until(lambda: _count(running, "third") > 100)
    before = _count(running, "third")
    removed = _adapt(running, Remove("third"))
    assert _undo(running, removed).outcome is Outcome.APPLIED
    begins = [line for line in running.client.logs("third") if line.startswith("ticker begins at")]
    assert int(begins[-1].split()[-1]) >= before - 50
    assert _adapt(running, Remove("third")).outcome is Outcome.APPLIED
    assert _adapt(running, Add("third", OTHER)).outcome is Outcome.APPLIED
    begins = [line for line in running.client.logs("third") if line.startswith("ticker begins at")]
    assert begins[-1] == "ticker begins at 0"


def _count(system: System, name: str) -> int:
    snapshot = system.client.control(name, "state")
    assert isinstance(snapshot, Snapshot)
    count: int = snapshot.state["count"]
    return count


def test_a_class_that_nobody_has_imported_yet_is_added(running: System) -> None:
    report = _adapt(running, Add("late", ComponentSpec(cls="late:Late", parameters={"path": "some/file"})))
    assert report.outcome is Outcome.APPLIED, report

    def says() -> str:
        status = running.client.components()["late"].status
        return status.detail if status else ""

    wait_until(lambda: says() == str(_folder(running) / "some" / "file"))


def _folder(system: System) -> Path:
    """Return the folder of the stack."""
    return Path(system.info.stack).parent


def test_what_needs_a_file_is_not_added_without_it(running: System) -> None:
    (_folder(running) / "wheels.json").write_text("")
    spec = ComponentSpec(cls="later:Late", parameters={"needed": "wheel.json"})
    report = _adapt(running, Add("needy", spec))
    assert report.outcome is Outcome.REJECTED
    (violation,) = report.violations
    assert (violation.component, violation.field) == ("needy", "parameters.needed")
    assert violation.problem.startswith(f"'{_folder(running) / 'wheel.json'}': there is no such file; did you mean")
    assert "needy" not in running.client.components()


def test_a_program_is_added_and_removed(running: System) -> None:
    spec = ComponentSpec(command=("sh", "-c", "exec sleep 1000"), managed=False)
    report = _adapt(running, Add("notes", spec))
    assert report.outcome is Outcome.APPLIED, report
    process = running.wait_running("notes")
    kill(process.pid)
    again = running.wait_running("notes", 2)
    assert _adapt(running, Remove("notes")).outcome is Outcome.APPLIED
    assert not exists(again.pid)
    wait_until(lambda: "notes" not in _names(running))


@pytest.mark.parametrize(
    ("cls", "text"),
    [
        ("deadly_import:Nobody", "exit code 7"),
        ("later:Nobody", "has no class 'Nobody'"),
        ("os:getpid", "is no subclass"),
    ],
)
def test_a_class_that_cannot_be_had_is_rejected_and_harms_nobody(running: System, cls: str, text: str) -> None:
    before = running.processes()
    report = _adapt(running, Add("bad", ComponentSpec(cls=cls)))
    assert report.outcome is Outcome.REJECTED
    assert text in report.violations[0].problem, report.violations
    assert {name: p.pid for name, p in running.processes().items()} == {name: p.pid for name, p in before.items()}


@pytest.mark.parametrize(
    ("spec", "text"),
    [
        (ComponentSpec(cls="tests.host.parts:Stillborn"), "exit code 3; its log ends with: no life in me"),
        (ComponentSpec(cls="tests.host.parts:Sleeper", parameters={"where": "configure"}), "sleeper"),
        (ComponentSpec(cls="tests.host.parts:Sleeper", parameters={"where": "activate"}), "sleeper"),
    ],
    ids=["dies", "hangs-configuring", "hangs-activating"],
)
def test_what_breaks_as_it_starts_leaves_no_process_behind(running: System, spec: ComponentSpec, text: str) -> None:
    before = children_of(running.process.pid)
    report = _adapt(running, Add("sleeper", spec), Remove("ticker"))
    assert report.outcome is Outcome.ROLLED_BACK, report
    assert text in report.error
    assert children_of(running.process.pid) == before
    wait_until(lambda: _names(running) == KEPT)
    assert running.client.view("ticker").state is State.ACTIVE
    assert running.processes()["ticker"].incarnation == 1


def test_the_manager_killed_while_it_adds_leaves_no_process_behind(running: System) -> None:
    before = running.wait_running("adaptation_manager")
    spec = ComponentSpec(cls="tests.host.parts:Sleeper", parameters={"where": "configure", "seconds": 0.25})
    pending = _adapt(running, Add("sleeper", spec), Remove("ticker"), wait=False)
    wait_until(lambda: "sleeper" in _names(running) and running.processes()["sleeper"].pid)
    kill(before.pid)
    running.wait_running("adaptation_manager", before.incarnation + 1)

    def line() -> AdaptationReport:
        return running.client.call(
            "adaptation_manager/journal", JournalRequest(pending.id), JournalPage, PATIENCE
        ).entries[0]

    wait_until(lambda: line().outcome is not Outcome.PENDING)
    assert line().outcome is Outcome.ROLLED_BACK
    wait_until(lambda: _names(running) == KEPT)
    assert running.client.view("ticker").state is State.ACTIVE


def test_what_is_removed_stubbornly_is_ended_by_force(running: System) -> None:
    assert _adapt(running, Add("stubborn", ComponentSpec(cls="tests.host.parts:Stubborn"))).outcome is Outcome.APPLIED
    pid = running.wait_running("stubborn").pid
    assert _adapt(running, Remove("stubborn")).outcome is Outcome.APPLIED
    assert not exists(pid)


def test_a_quarantined_component_can_be_removed(start: Start, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("tests.host.conftest.HEAD", ALL)
    dying = "  dying: {class: 'tests.host.parts:Stillborn', restart: {limit: 0, window: 30}}\n"
    system = start(dying + STACK)
    system.wait_for("dying", lambda p: p.state is ProcessState.QUARANTINED, "quarantined")
    system.wait_running("adaptation_manager")
    assert _adapt(system, Remove("dying")).outcome is Outcome.APPLIED
    wait_until(lambda: "dying" not in _names(system))
