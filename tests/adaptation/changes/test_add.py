"""Components are added while the system runs: all of it, or nothing is left."""

from __future__ import annotations

import pytest

from regraft.bus_schema.messages.management.manager import ArchitectureRequest
from regraft.bus_schema.messages.protocol.host import ProcessState
from regraft.bus_schema.model.adaptation import (
    Add,
    ChangeState,
    Connect,
    Outcome,
    Remove,
    SetParameters,
    StepState,
)
from regraft.bus_schema.model.architecture import Architecture, ComponentSpec, TopicSpec
from regraft.bus_schema.model.lifecycle import State, Transition
from tests.adaptation.parts import Listener, Newcomer
from tests.adaptation.system import System, spec_of
from tests.support.waiting import wait_until

NEWCOMER = ComponentSpec(cls="tests.adaptation.parts:Newcomer")
LISTENER = ComponentSpec(cls="tests.adaptation.parts:Listener")


@pytest.fixture(autouse=True)
def _held() -> None:
    Newcomer.release.clear()


def test_an_added_component_runs_as_its_spec_says_and_takes_part(system: System) -> None:
    spec = ComponentSpec(
        cls="tests.adaptation.parts:Listener", parameters={"gain": 0.25, "fixed": 7}, connections={"heard": "others"}
    )
    report = system.adapt(Add("third", spec))
    assert report.outcome is Outcome.APPLIED, report
    assert [step.state for step in report.steps] == [StepState.DONE, StepState.DONE]
    view = system.view("third")
    assert (view.state, view.parameters["gain"], view.parameters["fixed"]) == (State.ACTIVE, 0.25, 7)
    assert view.connections == {"heard": "others", "hint": "hints"}
    assert view.revision == report.revision_after == 2
    given = system.host.specs["third"]
    assert (given.state, given.restart.when.value) == (State.ACTIVE, "always")
    assert given.description is not None
    heard = system.running["third"].component.log
    wait_until(lambda: len(heard) > 10)
    assert {source for source, _ in heard} == {"other"}
    assert system.adapt(SetParameters("third", {"gain": 0.5})).outcome is Outcome.APPLIED


def test_what_an_added_component_says_first_is_heard(system: System) -> None:
    report = system.adapt(Connect("listener", "hint", "spare"), Add("newcomer", NEWCOMER))
    assert report.outcome is Outcome.APPLIED, report
    listener = system.running["listener"].component
    assert listener.hint.latest is not None
    wait_until(lambda: len(system.running["newcomer"].component.log) > 10)


@pytest.mark.parametrize("state", [State.UNCONFIGURED, State.INACTIVE])
def test_a_component_may_be_added_in_another_state(system: System, state: State) -> None:
    report = system.adapt(Add("third", ComponentSpec(cls="tests.adaptation.parts:Listener", state=state)))
    assert report.outcome is Outcome.APPLIED, report
    assert system.view("third").state is state
    assert system.host.specs["third"].state is state


def test_a_topic_comes_and_goes_with_its_component(system: System) -> None:
    spec = ComponentSpec(cls="tests.adaptation.parts:Newcomer", connections={"said": "fresh"})
    fresh = TopicSpec("fresh", "regraft/Twist")
    missing = system.adapt(Add("newcomer", spec))
    assert "'fresh', which is not in the topic table" in missing.violations[0].problem
    report = system.adapt(Add("newcomer", spec, (fresh,)), Connect("listener", "heard", "fresh"))
    assert report.outcome is Outcome.APPLIED, report
    log = system.running["listener"].component.log
    wait_until(lambda: any(source == "newcomer" for source, _ in log))
    report = system.adapt(Remove("newcomer", ("fresh",)))
    assert any("'fresh', which is not in the topic table" in v.problem for v in report.violations), report
    undone = system.undo("3")
    assert undone.outcome is Outcome.APPLIED, undone
    assert "fresh" not in system.host.architecture.topics
    assert "newcomer" not in system.host.specs


def test_further_changes_of_the_newcomer_may_follow_in_the_same_request(system: System) -> None:
    report = system.adapt(
        Add("third", LISTENER),
        SetParameters("third", {"gain": 0.75}),
        Connect("third", "heard", "others"),
        ChangeState("third", Transition.DEACTIVATE),
    )
    assert report.outcome is Outcome.APPLIED, report
    view = system.view("third")
    assert (view.state, view.parameters["gain"], view.connections["heard"]) == (State.INACTIVE, 0.75, "others")
    assert system.host.specs["third"].connections["heard"] == "others"


def test_all_that_is_wrong_with_an_addition_is_said_at_once(system: System) -> None:
    bad = ComponentSpec(
        cls="tests.adaptation.parts:Listener", parameters={"gain": 7.0, "colour": 1}, connections={"heard": "scan"}
    )
    report = system.adapt(
        Add("third", bad),
        Add("listener", LISTENER),
        Add("fourth", ComponentSpec(cls="no.such.module:Nobody")),
        SetParameters("talker", {"rate": -1.0}),
        SetParameters("fourth", {"gain": 0.5}),
    )
    assert report.outcome is Outcome.REJECTED
    assert {(v.change, v.component, v.field) for v in report.violations} == {
        (0, "third", "parameters.gain"),
        (0, "third", "parameters.colour"),
        (1, "listener", "component"),
        (2, "fourth", "class"),
        (3, "talker", "parameters.rate"),
    }


@pytest.mark.parametrize(
    ("spec", "field", "text"),
    [
        (ComponentSpec(cls="tests.adaptation.parts:Nobody"), "class", "has no class 'Nobody'"),
        (ComponentSpec(cls="no.such.module:Nobody"), "class", "cannot import"),
        (ComponentSpec(cls="tests.adaptation.parts:Ticker"), "class", "is a source of time"),
        (ComponentSpec(), "class", "either a class or a command"),
        (ComponentSpec(command=("no-such-program",), managed=False), "command", "no program"),
        (ComponentSpec(cls="tests.adaptation.parts:Listener", host="moon"), "host", "no host 'moon'"),
        (
            ComponentSpec(cls="tests.adaptation.parts:Listener", parameters={"gain": 7.0}),
            "parameters.gain",
            "at most 1.0",
        ),
        (
            ComponentSpec(cls="tests.adaptation.parts:Listener", connections={"ear": "numbers"}),
            "connect.ear",
            "no port",
        ),
        (
            ComponentSpec(cls="tests.adaptation.parts:Listener", connections={"heard": "scan"}),
            "connect.heard",
            "carries",
        ),
        (
            ComponentSpec(cls="tests.adaptation.parts:Listener", connections={"heard": "spare"}),
            "connect.heard",
            "required",
        ),
        (ComponentSpec(cls="tests.adaptation.parts:Talker"), "connect.numbers", "one writer"),
        (ComponentSpec("other", "tests.adaptation.parts:Listener"), "spec.name", "must be 'third'"),
    ],
)
def test_an_addition_that_cannot_be_is_rejected(system: System, spec: ComponentSpec, field: str, text: str) -> None:
    before = system.views()
    report = system.adapt(Add("third", spec))
    assert report.outcome is Outcome.REJECTED
    assert any(v.field == field and text in v.problem for v in report.violations), report.violations
    assert system.views() == before
    assert "third" not in system.host.specs


@pytest.mark.parametrize("where", ["configure", "activate"])
@pytest.mark.parametrize("how", ["refuses", "hangs", "dies"])
def test_a_newcomer_that_breaks_as_it_is_started_leaves_nothing_behind(impatient: System, where: str, how: str) -> None:
    system = impatient
    system.ends_are_seen = True
    before, specs = system.views(), dict(system.host.specs)
    if how == "dies":
        Newcomer.release.set()
    spec = ComponentSpec(cls="tests.adaptation.parts:Newcomer", parameters={"where": where, "how": how})
    report = system.adapt(
        SetParameters("listener", {"gain": 0.9}),
        Add("newcomer", spec),
        Connect("listener", "hint", "spare"),
    )
    assert report.outcome is Outcome.ROLLED_BACK, report
    assert "newcomer" in report.error
    assert {"refuses": "no life in me", "hangs": "no answer within", "dies": "newcomer"}[how] in report.error
    assert "newcomer" not in system.running
    assert "newcomer" not in system.host.processes
    assert system.views() == before
    assert system.host.specs == specs
    again = system.adapt(Add("newcomer", NEWCOMER))
    assert again.outcome is Outcome.APPLIED, again
    assert system.view("newcomer").incarnation == 2


def test_a_host_that_does_not_start_it_leaves_everything_as_it_was(impatient: System) -> None:
    impatient.host.deaf = {"start"}
    specs = dict(impatient.host.specs)
    report = impatient.adapt(Add("third", LISTENER))
    assert report.outcome is Outcome.ROLLED_BACK, report
    assert "host 'local': start: no answer" in report.error
    assert impatient.host.specs == specs
    assert "third" not in impatient.host.processes


def test_a_later_failure_takes_the_newcomer_back(system: System) -> None:
    system.adapt(SetParameters("fragile", {"mood": "refuses"}))
    before, specs = system.views(), dict(system.host.specs)
    report = system.adapt(Add("third", LISTENER), SetParameters("fragile", {"level": 3}))
    assert report.outcome is Outcome.ROLLED_BACK, report
    assert system.views() == before
    assert system.host.specs == specs


def test_a_dry_run_starts_nothing_and_shows_what_would_be(system: System) -> None:
    report = system.adapt(Add("third", LISTENER), dry_run=True)
    assert report.outcome is Outcome.PENDING
    assert report.architecture is not None
    assert report.architecture.components["third"].connections == {"heard": "numbers", "hint": "hints"}
    assert [step.action for step in report.steps] == [
        "start tests.adaptation.parts:Listener on local, inactive",
        "connect and activate",
    ]
    assert "third" not in system.host.processes


def test_undoing_an_addition_ends_it(system: System) -> None:
    report = system.adapt(Add("third", LISTENER))
    undone = system.undo(report.id)
    assert undone.outcome is Outcome.APPLIED, undone
    assert "third" not in system.running
    assert "third" not in system.host.specs
    again = system.undo(undone.id)
    assert again.outcome is Outcome.APPLIED, again
    assert system.view("third").incarnation == 2


def test_additions_that_name_the_same_new_topic_are_undone_with_it(system: System) -> None:
    writer = ComponentSpec(cls="tests.adaptation.parts:Newcomer", connections={"said": "fresh"})
    reader = ComponentSpec(cls="tests.adaptation.parts:Listener", connections={"heard": "fresh"})
    fresh = (TopicSpec("fresh", "regraft/Twist"),)
    report = system.adapt(Add("newcomer", writer, fresh), Add("third", reader, fresh))
    assert report.outcome is Outcome.APPLIED, report
    undone = system.undo(report.id)
    assert undone.outcome is Outcome.APPLIED, undone
    assert "fresh" not in system.host.architecture.topics
    assert {"newcomer", "third"}.isdisjoint(system.host.specs)
    again = system.undo(undone.id)
    assert again.outcome is Outcome.APPLIED, again
    assert system.view("third").connections["heard"] == "fresh"


def test_undoing_an_addition_that_is_gone_already_is_refused(system: System) -> None:
    report = system.adapt(Add("third", LISTENER))
    system.adapt(Remove("third"))
    undone = system.undo(report.id)
    assert undone.outcome is Outcome.REJECTED
    assert "adaptation 3" in undone.violations[0].problem


def test_the_journal_has_the_architecture_of_every_revision(system: System) -> None:
    system.adapt(Add("third", LISTENER))
    system.adapt(Remove("third"))
    system.running["manager"].kill()
    system.start_manager()

    def at(revision: int) -> Architecture:
        return system.client.call("adaptation_manager/architecture", ArchitectureRequest(revision), Architecture)

    assert ["third" in at(revision).components for revision in (1, 2, 3)] == [False, True, False]
    assert at(2).components["third"] == spec_of("third", Listener, services={})
    assert system.host.processes["listener"].state is ProcessState.RUNNING


def test_several_newcomers_that_feed_each_other_are_added_at_once(system: System) -> None:
    writer = ComponentSpec(cls="tests.adaptation.parts:Talker", connections={"numbers": "fresh"})
    reader = ComponentSpec(cls="tests.adaptation.parts:Listener", connections={"heard": "fresh"})
    report = system.adapt(
        Add("reader", reader),
        Add("writer", writer, (TopicSpec("fresh", "regraft/Twist"),)),
        SetParameters("talker", {}),
    )
    assert report.outcome is Outcome.REJECTED, "one violation is enough to touch nothing"
    assert "reader" not in system.host.processes
    report = system.adapt(Add("reader", reader), Add("writer", writer, (TopicSpec("fresh", "regraft/Twist"),)))
    assert report.outcome is Outcome.APPLIED, report
    log = system.running["reader"].component.log
    wait_until(lambda: len(log) > 10)
    assert log[0] == ("writer", 1), "from its first word on"
    assert system.adapt(Remove("reader"), Remove("writer", ("fresh",))).outcome is Outcome.APPLIED


def test_a_host_that_is_silent_for_a_while_is_waited_for(impatient: System) -> None:
    system = impatient
    launch = system.host.launch

    def launch_and_fall_silent(name: str, incarnation: int) -> None:
        system.host.skips = 2
        launch(name, incarnation)

    system.host.launch = launch_and_fall_silent
    report = system.adapt(Add("third", LISTENER))
    assert report.outcome is Outcome.APPLIED, report
    terminate = system.host.terminate

    def terminate_and_fall_silent(name: str) -> None:
        system.host.skips = 2
        terminate(name)

    system.host.terminate = terminate_and_fall_silent
    assert system.adapt(Remove("third")).outcome is Outcome.APPLIED
    assert "third" not in system.host.processes
