"""For every kind of change and every step at which it can fail: what stands is as before, or as was asked for."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from regraft.bus_schema.model.adaptation import Change, Move, Outcome, Swap
from tests.failures.injecting import Fault
from tests.failures.kinds import ELSEWHERE, KINDS, KINDS_OF_TWO_HOSTS
from tests.failures.place import Place
from tests.failures.walk import Walk, plan, walk

pytestmark = pytest.mark.slow

WAYS = (
    *(("before", how, "component") for how in ("die", "hang", "late")),
    ("during", "die", "component"),
    *(("inside", how, "component") for how in ("die", "hang", "refuse", "late")),
    *((when, "die", "manager") for when in ("before", "during", "after")),
    ("during", "hang", "manager"),
)
"""How a step can fail: when, how, and who."""
OF_HAND_OVERS = tuple(
    (method, how) for method in ("restore", "on_activate") for how in ("die", "hang", "refuse", "late")
)
"""How it can fail besides where one run of a component takes over from another: in which method, and how."""

OF_HOSTS = (*((when, "die", "host") for when in ("before", "during", "after")), ("before", "late", "host"))
"""How it can fail besides where a second host takes part."""

Ways = tuple[tuple[str, str, str], ...]
Start = Callable[..., Place]


@pytest.fixture
def start(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Start]:
    """Return what starts the system that is changed; it leaves nothing behind."""
    monkeypatch.setenv("REGRAFT_HOME", str(tmp_path / "home"))
    started: list[Place] = []

    def run(hosts: int = 1) -> Place:
        started.append(Place(tmp_path, hosts=hosts))
        return started[-1]

    yield run
    for place in started:
        place.end()


def _walks(
    place: Place, kind: str, changes: tuple[Change, ...], ways: Ways, inside: tuple[tuple[str, str], ...] = ()
) -> list[Walk]:
    """Return every way to fail at every step; ``inside`` are those of a hand-over."""
    handed_over = {change.component for change in changes if isinstance(change, Swap | Move)}
    walks = []
    for step, component in enumerate(plan(place.system, changes), start=1):
        faults = [Fault(step, when, how, who) for when, how, who in ways]
        if component in handed_over:
            faults += [Fault(step, "inside", how, method=method) for method, how in inside]
        walks += [Walk(kind, changes, fault, component) for fault in faults]
    return walks


def _walk_all(place: Place, walks: list[Walk]) -> Counter[Outcome]:
    outcomes: Counter[Outcome] = Counter()
    for one in walks:
        print(one, end=": ", flush=True)
        outcome = walk(place, one)
        print(outcome.value, flush=True)
        outcomes[outcome] += 1
    print({outcome.value: count for outcome, count in outcomes.items()})
    return outcomes


@pytest.mark.evidence
@pytest.mark.parametrize("kind", KINDS)
def test_whatever_fails_at_any_step_all_of_it_has_happened_or_none(start: Start, kind: str) -> None:
    place = start()
    _walk_all(place, _walks(place, kind, KINDS[kind], WAYS, OF_HAND_OVERS))


@pytest.mark.evidence
@pytest.mark.parametrize("kind", KINDS_OF_TWO_HOSTS)
def test_whatever_fails_at_any_step_of_a_move_all_of_it_has_happened_or_none(start: Start, kind: str) -> None:
    place = start(hosts=2)
    _walk_all(place, _walks(place, kind, KINDS_OF_TWO_HOSTS[kind], (*WAYS, *OF_HOSTS), OF_HAND_OVERS))


@pytest.mark.evidence
@pytest.mark.parametrize("kind", ELSEWHERE)
def test_whenever_the_host_dies_of_what_is_changed_all_of_it_has_happened_or_none(start: Start, kind: str) -> None:
    place = start(hosts=2)
    _walk_all(place, _walks(place, kind, ELSEWHERE[kind], OF_HOSTS))


def test_whatever_fails_at_some_steps_of_several_changes_all_of_it_has_happened_or_none(start: Start) -> None:
    place = start()
    several, swap = (_walks(place, kind, KINDS[kind], WAYS, OF_HAND_OVERS) for kind in ("several", "swap"))
    disconnect = _walks(place, "disconnect", KINDS["disconnect"], WAYS)
    walks = [*several[::18], *swap[::9], *disconnect[1::9]]
    assert _walk_all(place, walks)[Outcome.ROLLED_BACK] > 0


def test_whatever_fails_at_some_steps_of_a_move_all_of_it_has_happened_or_none(start: Start) -> None:
    place = start(hosts=2)
    walks = _walks(place, "move", KINDS_OF_TWO_HOSTS["move"], (*WAYS, *OF_HOSTS), OF_HAND_OVERS)
    assert _walk_all(place, walks[3::13])[Outcome.ROLLED_BACK] > 0
