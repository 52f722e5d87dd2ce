"""A name that is mistyped in a request is told with the one that may be meant, whoever asked."""

from __future__ import annotations

from dataclasses import replace

import pytest

from regraft.bus_schema.model.adaptation import Add, Change, Connect, EnterMode, Move, Outcome, Remove, SetParameters
from regraft.bus_schema.model.architecture import ComponentSpec
from tests.adaptation.system import System, small_architecture

LISTENER = ComponentSpec(cls="tests.adaptation.parts:Listener")


@pytest.mark.parametrize(
    ("change", "meant"),
    [
        (SetParameters("listner", {"gain": 0.5}), "listener"),
        (SetParameters("listener", {"gian": 0.5}), "gain"),
        (Connect("listener", "hard", "others"), "heard"),
        (Connect("listener", "heard", "othrs"), "others"),
        (Remove("listener", ("othrs",)), "others"),
        (Move("listener", "locl"), "local"),
        (EnterMode("quit"), "quiet"),
        (Add("third", replace(LISTENER, host="locl")), "local"),
        (Add("third", replace(LISTENER, cls="tests.adaptation.parts:Listner")), "Listener"),
        (Add("third", replace(LISTENER, cls="tests.adaptation.prts:Listener")), "tests.adaptation.parts"),
    ],
    ids=lambda part: str(part)[:60],
)
def test_a_rejection_names_what_may_be_meant(bare_system: System, change: Change, meant: str) -> None:
    quiet = [{"change": "set_parameters", "component": "talker", "parameters": {"rate": 10.0}}]
    bare_system.host.architecture = replace(small_architecture(), modes={"quiet": quiet})
    bare_system.start_manager()
    report = bare_system.adapt(change)
    assert report.outcome is Outcome.REJECTED
    assert any(f"did you mean '{meant}'?" in violation.problem for violation in report.violations), report.violations


def test_30000_names_that_do_not_exist_are_refused_without_a_search_for_each(system: System) -> None:
    report = system.adapt(SetParameters("listener", {f"gain{number}": 0.5 for number in range(30_000)}))
    assert report.outcome is Outcome.REJECTED
    meant = [violation for violation in report.violations if "did you mean" in violation.problem]
    assert 0 < len(meant) <= 20
