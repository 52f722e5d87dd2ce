"""Swaps that cannot be are refused before anything is touched."""

from __future__ import annotations

import pytest

from regraft.adaptation_manager.manager import AdaptationManager
from regraft.bus_schema.model.adaptation import (
    Add,
    Change,
    Connect,
    Outcome,
    Remove,
    SetParameters,
    Swap,
)
from regraft.bus_schema.model.architecture import ComponentSpec
from tests.adaptation.swaps.relaying import (
    DOUBLER,
    class_of,
)
from tests.adaptation.system import System, spec_of


def test_all_that_is_wrong_is_said_at_once_and_nothing_is_touched(site: System) -> None:
    before = site.views()
    site.adapt(SetParameters("totaller", {"offset": 900}))
    report = site.adapt(
        Swap("totaller", class_of("Counting"), {"colour": 1}, {"items": "numbers", "nothing": "items"}, {"gone": "x"}),
        Swap("sink", "no.such.module:Nobody"),
        Swap("fragile", class_of("Needy")),
        Swap("nobody", DOUBLER.cls),
        SetParameters("source", {"rate": -1.0}),
    )
    assert report.outcome is Outcome.REJECTED
    assert {(v.change, v.component, v.field) for v in report.violations} >= {
        (0, "totaller", "parameters.colour"),
        (0, "totaller", "parameters.offset"),
        (0, "totaller", "connect.items"),
        (0, "totaller", "connect.nothing"),
        (0, "totaller", "services.gone"),
        (1, "sink", "class"),
        (2, "fragile", "connect.more"),
        (3, "nobody", "component"),
        (4, "source", "parameters.rate"),
    }, report.violations
    after = site.views()
    assert after.pop("totaller")[2]["offset"] == 900
    assert after == {name: view for name, view in before.items() if name != "totaller"}


@pytest.mark.parametrize(
    ("changes", "text"),
    [
        ((DOUBLER, Swap("totaller")), "swapped twice"),
        ((DOUBLER, Remove("totaller")), "leave that out"),
        ((Remove("fragile"), Swap("fragile")), "removed earlier"),
        ((DOUBLER, SetParameters("totaller", {"offset": 4}), Swap("totaller", parameters={"offset": 5})), "twice"),
        ((Swap("totaller", DOUBLER.cls, {"offset": 4}), SetParameters("totaller", {"offset": 5})), "earlier among the"),
        ((Add("new", ComponentSpec(cls=class_of("Second"))), Swap("new", DOUBLER.cls)), "is added in the same request"),
        ((SetParameters("totaller", {"volume": 4}), DOUBLER), "no such parameter"),
        ((Connect("totaller", "elsewhere", "items"), DOUBLER), "no port 'elsewhere'"),
    ],
)
def test_contradictions_are_rejected(site: System, changes: tuple[Change, ...], text: str) -> None:
    report = site.adapt(*changes)
    assert report.outcome is Outcome.REJECTED, report
    assert any(text in violation.problem for violation in report.violations), report.violations


def test_the_manager_is_not_swapped_and_why(site: System) -> None:
    site.running.pop("manager").kill()
    site.host.specs["manager"] = spec_of("manager", AdaptationManager)
    site.journal.unlink()
    site.start_manager()
    site.host.started("manager", 1)
    report = site.adapt(Swap("manager"))
    assert "it carries out the swap" in report.violations[0].problem
