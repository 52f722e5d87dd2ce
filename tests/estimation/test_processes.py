"""Dry runs predict along connections; an estimator that raises, exits or hangs makes its own figures unknown."""

from __future__ import annotations

from pathlib import Path

import pytest

from regraft.bus_schema.model.adaptation import (
    AdaptationReport,
    Add,
    Change,
    ChangeState,
    Connect,
    Outcome,
    Remove,
    SetParameters,
    Swap,
)
from regraft.bus_schema.model.architecture import ComponentSpec, TopicSpec
from regraft.bus_schema.model.lifecycle import Transition
from regraft.bus_schema.model.qualities.estimates import QualityEstimate, Source
from regraft.estimation.changes import changed
from regraft.stack import load
from tests.estimation.parts import described
from tests.support.systems import System
from tests.support.waiting import PATIENCE

pytestmark = pytest.mark.slow


def dry_run(system: System, *changes: Change) -> tuple[AdaptationReport, dict[str, QualityEstimate]]:
    """Return the report, and the predicted qualities by component and name."""
    report = system.client.adapt(*changes, dry_run=True, timeout=2 * PATIENCE)
    assert report.outcome is Outcome.PENDING, report
    assert report.estimate is not None
    return report, {f"{each.component}.{each.quality}": each for each in report.estimate.qualities}


def test_a_dry_run_predicts_what_follows_from_a_change_along_the_connections(system: System) -> None:
    _, found = dry_run(system, SetParameters("source", {"rate": 20.0}))
    assert {name: (each.before, each.after) for name, each in found.items()} == {
        "source.flow": (10.0, 20.0),
        "first.flow": (5.0, 10.0),
        "second.flow": (2.5, 5.0),
    }
    assert {each.after_source for each in found.values()} == {Source.ESTIMATED}
    _, found = dry_run(system, Connect("first", "taken", "d"))
    assert {name: each.after for name, each in found.items()} == {"first.flow": 20.0, "second.flow": 10.0}
    _, found = dry_run(system, ChangeState("first", Transition.DEACTIVATE))
    assert (found["first.flow"].after, found["first.flow"].after_why) == (None, "the component is inactive")
    assert (found["second.flow"].before, found["second.flow"].after) == (2.5, None)


@pytest.mark.parametrize(
    ("name", "why"),
    [
        ("raising", "estimate raised RuntimeError: no idea"),
        ("leaving", "estimate raised SystemExit: 3"),
        ("exiting", "estimate ended with exit code 3"),
        ("hanging", "estimate took longer than 2 s"),
    ],
)
def test_an_estimator_that_fails_makes_its_own_figures_unknown_and_nothing_else(
    system: System, name: str, why: str
) -> None:
    if name == "hanging":
        change: Change = ChangeState(name, Transition.ACTIVATE)
    else:
        change = SetParameters(name, {"rate": 5.0})
    _, found = dry_run(system, change, SetParameters("source", {"rate": 20.0}))
    failed = found[f"{name}.flow"]
    assert (failed.before, failed.after, failed.after_source, failed.after_why) == (None, None, Source.UNKNOWN, why)
    assert (found["second.flow"].before, found["second.flow"].after) == (2.5, 5.0)
    assert system.processes()[name].incarnation == 1


NEW = ComponentSpec(cls="tests.estimation.parts:Source", connections={"made": "e"})
CANDIDATES: list[tuple[Change, ...]] = [
    (SetParameters("source", {"rate": 20.0}), Connect("first", "taken", "d")),
    (Swap("source", "tests.estimation.parts:Raising", {"rate": 3.0}),),
    (Swap("second", "tests.estimation.parts:Source", connections={"made": "c"}),),
    (Remove("second"), Remove("other", ("d",))),
    (Add("new", NEW, (TopicSpec("e", "regraft/Twist"),)),),
    (ChangeState("first", Transition.DEACTIVATE),),
]


@pytest.mark.parametrize("changes", CANDIDATES)
def test_a_candidate_that_nothing_runs_of_is_the_architecture_of_the_dry_run(
    system: System, stack: Path, changes: tuple[Change, ...]
) -> None:
    report, _ = dry_run(system, *changes)
    assert report.architecture is not None
    candidate = changed(load(stack).architecture, changes, described)
    assert candidate.components.keys() == report.architecture.components.keys()
    for name, spec in candidate.components.items():
        if name != "adaptation_manager":
            assert spec == report.architecture.components[name]
    assert candidate.topics == report.architecture.topics
