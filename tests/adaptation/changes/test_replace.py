"""A component that does not run is replaced by a swap: it is started as the other that it is to be."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest

from regraft.bus_schema.messages.protocol.host import ProcessState
from regraft.bus_schema.model.adaptation import Outcome, SetParameters, StepState, Swap
from regraft.bus_schema.model.lifecycle import State
from tests.adaptation.swaps.relaying import DOUBLER, class_of, hears_on, relaying
from tests.adaptation.system import System
from tests.handover.parts import Ask, Item
from tests.support.waiting import PATIENCE


@pytest.fixture
def site(tmp_path: Path) -> Iterator[System]:
    with relaying(tmp_path) as system:
        yield system


def _broken(system: System, how: ProcessState) -> None:
    system.running.pop("totaller").kill()
    system.host.ended("totaller", how)


@pytest.mark.parametrize("how", [ProcessState.QUARANTINED, ProcessState.STOPPED])
def test_what_is_broken_is_replaced_by_another_class(site: System, how: ProcessState) -> None:
    _broken(site, how)
    report = site.adapt(DOUBLER)
    assert report.outcome is Outcome.APPLIED, report
    assert [step.action for step in report.steps] == [
        "start tests.handover.parts:Doubler in its place, inactive",
        "connect and activate",
    ]
    view = site.view("totaller")
    assert (view.state, view.parameters["offset"]) == (State.ACTIVE, 3)
    assert site.host.specs["totaller"].restart == site.architecture.components["totaller"].restart
    assert site.client.call("double", Ask(21), Item, PATIENCE) == Item(42)
    hears_on(site)
    undone = site.undo(report.id)
    assert undone.outcome is Outcome.APPLIED, undone
    assert site.host.specs["totaller"].cls == site.architecture.components["totaller"].cls
    hears_on(site)


def test_a_replacement_that_is_no_better_leaves_it_as_it_was(site: System) -> None:
    _broken(site, ProcessState.QUARANTINED)
    for cls in ("Broken", "Lame"):
        report = site.adapt(Swap("totaller", class_of(cls)))
        assert report.outcome is Outcome.ROLLED_BACK, report
        assert {step.state for step in report.steps} <= {StepState.UNDONE, StepState.PLANNED}
        assert site.host.processes["totaller"].state is ProcessState.STOPPED
        assert site.host.specs == site.architecture.components
    site.adapt(SetParameters("fragile", {"mood": "refuses"}))
    report = site.adapt(DOUBLER, SetParameters("fragile", {"level": 3}))
    assert report.outcome is Outcome.ROLLED_BACK, report
    assert site.host.processes["totaller"].state is ProcessState.STOPPED
    assert site.adapt(DOUBLER).outcome is Outcome.APPLIED
    hears_on(site)


def test_hosts_keep_the_checkpoint_of_before_a_replacement_and_hear_that_it_was_undone(site: System) -> None:
    _broken(site, ProcessState.QUARANTINED)
    began = len(site.host.updates)
    assert site.adapt(Swap("totaller", class_of("Lame"))).outcome is Outcome.ROLLED_BACK
    trial, *_, last = site.host.updates[began:]
    assert (trial.on_trial, trial.revision) == (("totaller",), 2)
    assert (last.undoes, last.revision) == (2, 1)
    began = len(site.host.updates)
    assert site.adapt(DOUBLER).outcome is Outcome.APPLIED
    assert [update.undoes for update in site.host.updates[began:]] == [None, None]


def test_what_is_about_to_be_restarted_is_not_replaced_yet_and_why(site: System) -> None:
    _broken(site, ProcessState.STOPPED)
    site.host.processes["totaller"] = replace(site.host.processes["totaller"], state=ProcessState.WAITING)
    report = site.adapt(DOUBLER)
    assert report.outcome is Outcome.REJECTED
    assert "its process is waiting" in report.violations[0].problem
