"""Wherever a component is placed, its host has room for it: in the end and meanwhile."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest

from regraft.bus_schema.messages.protocol.host import ProcessState
from regraft.bus_schema.model.adaptation import AdaptationReport, Add, Change, ChangeState, Outcome, Remove, Swap
from regraft.bus_schema.model.architecture import ComponentSpec, HostRules
from regraft.bus_schema.model.lifecycle import State, Transition
from tests.adaptation.failures.needing import HERE, Exclusive, Small
from tests.adaptation.system import System, small_architecture, spec_of, started

LARGE = Swap("small", f"{HERE}:Large")
EXTRA = ComponentSpec(cls=f"{HERE}:Large")
DOWN, BARE = (ChangeState("small", transition) for transition in (Transition.DEACTIVATE, Transition.CLEANUP))


def _system(folder: Path, **offer: float) -> Iterator[System]:
    architecture = small_architecture()
    for spec in (spec_of("small", Small), spec_of("alone", Exclusive)):
        architecture = architecture.with_component(spec)
    memory = offer.pop("memory", None)
    rules = {"local": HostRules(memory=memory, amounts=offer)}
    with started(replace(architecture, host_rules=rules), folder) as system:
        system.ends_are_seen = True
        system.start_manager(answer_within=0.5, undo_within=1.0)
        yield system


@pytest.fixture
def tight(tmp_path: Path) -> Iterator[System]:
    """A host with 9 W of power, of which 4 are needed, and room for three components."""
    yield from _system(tmp_path, power=9.0, memory=30.0)


@pytest.fixture
def wide(tmp_path: Path) -> Iterator[System]:
    """A host with 10 W of power."""
    yield from _system(tmp_path, power=10.0)


def _problems(report: AdaptationReport) -> dict[tuple[int | None, str, str], str]:
    assert report.outcome is Outcome.REJECTED, report
    return {(one.change, one.component, one.field): one.problem for one in report.violations}


def test_more_than_is_offered_is_not_added(tight: System) -> None:
    assert _problems(tight.adapt(Add("one", EXTRA), Add("two", EXTRA))) == {
        (None, "", "hosts.local.amounts.power"): "offers 9 power, but its components need 14 "
        "(one 5, two 5, alone 2, small 2): place some of them elsewhere",
        (None, "", "hosts.local.memory"): "offers 30 MiB, but its components need 40 "
        "(alone 10, one 10, small 10, two 10): place some of them elsewhere",
    }
    assert tight.adapt(Add("one", EXTRA)).outcome is Outcome.APPLIED


def test_an_amount_or_a_device_that_a_host_lacks_is_named(tight: System) -> None:
    found = _problems(tight.adapt(Add("fast", ComponentSpec(cls=f"{HERE}:Fast"))))
    assert found[0, "fast", "resources.amounts.accelerator_area"] == (
        "needs 0.5 accelerator_area, and host 'local' offers none: name it under hosts.local.amounts; there are: power"
    )
    assert found[0, "fast", "resources.devices"].startswith("needs fpga for itself, and host 'local' has none")


def test_an_unconfigured_component_needs_no_named_amount_until_it_is_configured(tight: System) -> None:
    bare = replace(EXTRA, state=State.UNCONFIGURED)
    assert tight.adapt(Remove("alone"), DOWN).outcome is Outcome.APPLIED
    assert tight.adapt(Add("one", EXTRA)).outcome is Outcome.APPLIED
    assert tight.adapt(BARE, Add("two", bare)).outcome is Outcome.APPLIED
    configure = ChangeState("two", Transition.CONFIGURE)
    assert (None, "", "hosts.local.amounts.power") in _problems(tight.adapt(configure))


def test_an_incumbent_and_its_successor_both_need_room(tight: System) -> None:
    before = tight.views()
    found = _problems(tight.adapt(LARGE, Swap("alone", f"{HERE}:Small")))
    assert found.keys() == {(0, "small", "resources.memory"), (0, "small", "resources.amounts.power")}
    assert "host 'local' offers 9 power, but needs 11" in found[0, "small", "resources.amounts.power"]
    assert tight.views() == before


def test_where_there_is_room_for_both_they_are_swapped_and_undone(wide: System) -> None:
    report = wide.adapt(LARGE)
    assert report.outcome is Outcome.APPLIED, report
    assert wide.undo(report.id).outcome is Outcome.APPLIED


def test_an_exclusive_component_gives_its_amounts_back_before_its_successor_takes_them(wide: System) -> None:
    assert wide.adapt(LARGE).outcome is Outcome.APPLIED
    assert wide.adapt(Add("one", ComponentSpec(cls=f"{HERE}:Small"))).outcome is Outcome.APPLIED
    assert wide.adapt(Swap("alone", f"{HERE}:Exclusive")).outcome is Outcome.APPLIED
    assert (0, "one", "resources.amounts.power") in _problems(wide.adapt(Swap("one", f"{HERE}:Small")))


def test_what_is_removed_keeps_its_amounts_until_the_adaptation_is_applied(wide: System) -> None:
    assert wide.adapt(Add("one", EXTRA)).outcome is Outcome.APPLIED
    found = _problems(wide.adapt(Remove("one"), Add("two", EXTRA)))
    assert found.keys() == {(1, "two", "resources.amounts.power")}
    assert wide.adapt(Remove("one")).outcome is Outcome.APPLIED
    assert wide.adapt(Add("two", EXTRA)).outcome is Outcome.APPLIED


@pytest.mark.parametrize("changes", [(Remove("small"),), (DOWN,)])
def test_what_frees_an_amount_is_never_refused_for_room(tight: System, changes: tuple[Change, ...]) -> None:
    assert tight.adapt(*changes).outcome is Outcome.APPLIED


def test_a_component_that_does_not_run_is_replaced_without_room_for_both(tight: System) -> None:
    tight.running.pop("small").kill()
    tight.host.ended("small", ProcessState.QUARANTINED)
    report = tight.adapt(LARGE)
    assert report.outcome is Outcome.APPLIED, report
