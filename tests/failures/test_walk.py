"""For every kind of change and every step at which it can fail: what stands is as before, or as was asked for."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from bus_schema.adaptation import Outcome, Swap
from tests.failures.injecting import Fault
from tests.failures.kinds import KINDS, STACK
from tests.failures.walk import Walk, plan, walk
from tests.host.system import System, children_of, exists

WAYS = (
    *(("before", how, "component") for how in ("die", "hang", "late")),
    ("during", "die", "component"),
    *(("inside", how, "component") for how in ("die", "hang", "refuse", "late")),
    *((when, "die", "manager") for when in ("before", "during", "after")),
    ("during", "hang", "manager"),
)
"""How a step can fail: when, how, and who."""
OF_SWAPS = tuple((method, how) for method in ("restore", "on_activate") for how in ("die", "hang", "refuse", "late"))
"""How it can fail besides where one run of a component takes over from another: in which method, and how."""

Start = Callable[[], System]


@pytest.fixture
def start(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Start]:
    """Return what starts the system that is changed; it leaves nothing behind."""
    monkeypatch.setenv("REGRAFT_HOME", str(tmp_path / "home"))
    (tmp_path / "stack.yaml").write_text(STACK)
    started: list[System] = []

    def run() -> System:
        system = System(tmp_path / "stack.yaml")
        started.append(system)
        for name in ("relay", "second", "meter", "adaptation_manager"):
            system.wait_running(name)
        return system

    yield run
    for system in started:
        processes = children_of(system.process.pid)
        system.end()
        assert not [pid for pid in processes if exists(pid)]


def _walks(system: System, kind: str) -> list[Walk]:
    changes = KINDS[kind]
    concerned = plan(system, changes)
    swapped = {change.component for change in changes if isinstance(change, Swap)}
    walks = []
    for step, component in enumerate(concerned, start=1):
        faults = [Fault(step, when, how, who) for when, how, who in WAYS]
        if component in swapped:
            faults += [Fault(step, "inside", how, method=method) for method, how in OF_SWAPS]
        walks += [Walk(kind, changes, fault, component) for fault in faults]
    return walks


def _walk_all(system: System, walks: list[Walk]) -> Counter[Outcome]:
    outcomes: Counter[Outcome] = Counter()
    for one in walks:
        print(one, end=": ", flush=True)
        outcome = walk(system, one)
        print(outcome.value, flush=True)
        outcomes[outcome] += 1
    return outcomes


@pytest.mark.evidence
@pytest.mark.parametrize("kind", KINDS)
def test_whatever_fails_at_any_step_all_of_it_has_happened_or_none(start: Start, kind: str) -> None:
    system = start()
    outcomes = _walk_all(system, _walks(system, kind))
    print(kind, {outcome.value: count for outcome, count in outcomes.items()})


def test_whatever_fails_at_some_steps_of_several_changes_all_of_it_has_happened_or_none(start: Start) -> None:
    system = start()
    outcomes = _walk_all(system, [*_walks(system, "several")[::9], *_walks(system, "swap")[::7]])
    assert outcomes[Outcome.ROLLED_BACK] > 0
