"""Components are removed while the system runs; until that is certain, they only hold still."""

from __future__ import annotations

import threading

import pytest

from regraft.adaptation_manager.manager import AdaptationManager
from regraft.bus_schema.messages.protocol.host import ProcessState
from regraft.bus_schema.model.adaptation import Add, ChangeState, Connect, Outcome, Remove, SetParameters, StepState
from regraft.bus_schema.model.architecture import ComponentSpec, Constraint, ConstraintKind
from regraft.bus_schema.model.lifecycle import State, Transition
from tests.adaptation.parts import Newcomer, Ticker
from tests.adaptation.system import System, small_architecture, spec_of
from tests.support.waiting import PATIENCE, wait_until


def test_a_removed_component_is_gone_from_everywhere(system: System) -> None:
    report = system.adapt(Remove("second"))
    assert report.outcome is Outcome.APPLIED, report
    assert [step.action for step in report.steps] == ["deactivate, to be ended"]
    assert "second" not in system.running
    assert "second" not in system.host.processes
    assert "second" not in system.host.specs
    rejected = system.adapt(SetParameters("second", {"gain": 0.1}))
    assert "there is no component of this name" in rejected.violations[0].problem


def test_undoing_a_removal_brings_it_back_as_it_was(system: System) -> None:
    system.adapt(SetParameters("second", {"gain": 0.75}), Connect("second", "heard", "numbers"))
    system.adapt(ChangeState("second", Transition.DEACTIVATE))
    before = system.view("second")
    removed = system.adapt(Remove("second"))
    undone = system.undo(removed.id)
    assert undone.outcome is Outcome.APPLIED, undone
    after = system.view("second")
    assert (after.state, after.parameters, after.connections) == (before.state, before.parameters, before.connections)
    assert after.incarnation == before.incarnation + 1
    assert system.adapt(ChangeState("second", Transition.ACTIVATE)).outcome is Outcome.APPLIED


def test_a_writer_that_is_needed_is_not_removed_but_with_its_readers_it_is(system: System) -> None:
    report = system.adapt(Remove("other"))
    assert report.outcome is Outcome.REJECTED
    (violation,) = report.violations
    assert (violation.change, violation.component, violation.field) == (0, "second", "connect.heard")
    assert "required, but no component writes topic 'others'" in violation.problem
    assert system.adapt(Remove("other"), Remove("second")).outcome is Outcome.APPLIED


def test_an_exchange_in_one_adaptation(system: System) -> None:
    report = system.adapt(
        Remove("other"),
        Add("third", ComponentSpec(cls="tests.adaptation.parts:Talker", connections={"numbers": "others"})),
    )
    assert report.outcome is Outcome.APPLIED, report
    log = system.running["second"].component.log
    wait_until(lambda: any(source == "third" for source, _ in log))
    assert next(value for source, value in log if source == "third") == 1


def test_a_constraint_holds_against_removals(bare_system: System) -> None:
    constraint = Constraint(ConstraintKind.AT_LEAST_ONE_ACTIVE, ("second",), because="somebody must listen")
    bare_system.host.architecture = small_architecture((constraint,))
    bare_system.start_manager()
    report = bare_system.adapt(Remove("second"))
    assert report.outcome is Outcome.REJECTED
    assert "somebody must listen" in report.violations[0].problem


def test_what_a_system_cannot_be_without_is_not_removed_and_why(bare_system: System) -> None:
    bare_system.host.specs["manager"] = spec_of("manager", AdaptationManager)
    bare_system.host.specs["ticker"] = spec_of("ticker", Ticker, state=State.UNCONFIGURED)
    bare_system.start_manager()
    bare_system.host.started("manager", 1)
    report = bare_system.adapt(Remove("manager"), Remove("ticker"))
    assert report.outcome is Outcome.REJECTED
    problems = {violation.component: violation.problem for violation in report.violations}
    assert "carries out every change" in problems["manager"]
    assert "simulated time needs it" in problems["ticker"]


@pytest.mark.parametrize(
    "changes",
    [
        (Remove("nobody"),),
        (Remove("second"), Remove("second")),
        (Remove("second"), SetParameters("second", {"gain": 0.1})),
        (Remove("second"), Add("second", ComponentSpec(cls="tests.adaptation.parts:Listener"))),
        (Remove("second", ("nothing",)),),
        (Remove("second", ("numbers",)),),
    ],
)
def test_a_removal_that_cannot_be_is_rejected(system: System, changes: tuple[Remove, ...]) -> None:
    before, specs = system.views(), dict(system.host.specs)
    report = system.adapt(*changes)
    assert report.outcome is Outcome.REJECTED, report
    assert system.views() == before
    assert system.host.specs == specs


def test_a_later_failure_hands_the_living_process_its_part_back(system: System) -> None:
    system.adapt(SetParameters("fragile", {"mood": "refuses"}))
    process, log = system.running["second"], system.running["second"].component.log
    wait_until(lambda: len(log) > 10)
    before, specs = system.views(), dict(system.host.specs)
    report = system.adapt(Remove("second"), SetParameters("fragile", {"level": 3}))
    assert report.outcome is Outcome.ROLLED_BACK, report
    assert system.running["second"] is process
    assert system.views() == before
    assert system.host.specs == specs
    heard = len(log)
    wait_until(lambda: len(log) > heard + 10)
    assert process.component.log is log, "it knows all that it knew"
    values = [value for _, value in log]
    assert values == list(range(values[0], values[0] + len(values))), "it has handled what came meanwhile"


def test_a_host_that_refuses_leaves_everything_as_it_was(system: System) -> None:
    before, specs = system.views(), dict(system.host.specs)
    system.host.refuse = "not today"
    report = system.adapt(Remove("second"))
    assert report.outcome is Outcome.STUCK
    assert "the former specs of second" in report.error
    assert [step.state for step in report.steps] == [StepState.UNDONE]
    assert system.views() == before
    assert system.host.specs == specs
    system.host.refuse = ""
    assert system.adapt(Remove("second")).outcome is Outcome.APPLIED


def test_what_hangs_can_be_removed(impatient: System) -> None:
    system = impatient
    gate = threading.Event()
    system.running["second"].runtime.post(lambda: gate.wait(PATIENCE))

    def kill(name: str) -> None:
        gate.set()
        system.running.pop(name).kill()

    system.host.terminate = kill
    report = system.adapt(Remove("second"))
    assert report.outcome is Outcome.APPLIED, report
    assert report.steps == ()
    assert "second" not in system.host.processes


def test_what_is_not_running_can_be_removed(system: System) -> None:
    system.running["second"].kill()
    system.host.ended("second", ProcessState.QUARANTINED)
    report = system.adapt(Remove("second"))
    assert report.outcome is Outcome.APPLIED, report
    assert report.steps == ()
    assert "second" not in system.host.processes


def test_a_host_that_does_not_end_it_is_told_again_later(impatient: System) -> None:
    system = impatient
    system.host.deaf = {"stop"}
    report = system.adapt(Remove("second"))
    assert report.outcome is Outcome.APPLIED, report
    wait_until(lambda: any(e.kind == "adaptation.unfinished" for e in system.events))
    assert system.view("second").state is State.INACTIVE
    system.host.deaf = set()
    assert system.adapt(SetParameters("listener", {"gain": 0.1}), Connect("listener", "hint", "spare"))
    assert "second" not in system.host.processes


def test_an_adaptation_of_others_does_not_let_it_forget_what_a_host_has_still_to_end(impatient: System) -> None:
    system = impatient
    system.host.deaf = {"stop"}
    system.adapt(Remove("second"))
    wait_until(lambda: any(e.kind == "adaptation.unfinished" for e in system.events))
    assert system.adapt(SetParameters("listener", {"gain": 0.1})).outcome is Outcome.APPLIED
    system.host.deaf = set()
    assert system.adapt(SetParameters("listener", {"gain": 0.2})).outcome is Outcome.APPLIED
    assert "second" not in system.host.processes


def test_a_cancelled_removal_changes_nothing(impatient: System) -> None:
    system = impatient
    Newcomer.release.clear()
    before = system.views()
    slow = ComponentSpec(cls="tests.adaptation.parts:Newcomer", parameters={"where": "configure", "how": "hangs"})
    pending = system.adapt(Add("slow", slow), Remove("second"), wait=False)
    wait_until(lambda: "slow" in system.host.processes and system.host.processes["slow"].incarnation == 1)
    Newcomer.release.set()
    ended = system.cancel(pending.id)
    assert ended.outcome in (Outcome.CANCELLED, Outcome.ROLLED_BACK), ended
    assert system.views() == before
    assert all(step.state in (StepState.UNDONE, StepState.PLANNED) for step in ended.steps)
