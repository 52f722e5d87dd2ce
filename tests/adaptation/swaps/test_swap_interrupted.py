"""The manager ends amid a swap: the next one undoes it, or finds that it is complete."""

from __future__ import annotations

from typing import Any

import pytest

from regraft.adaptation_manager.execution import transaction
from regraft.adaptation_manager.journal.journal import Journal
from regraft.adaptation_manager.targets.host_client import Hosts
from regraft.bus_schema.model.adaptation import (
    Change,
    Outcome,
    SetParameters,
)
from tests.adaptation.failures.test_recovery import dying
from tests.adaptation.swaps.relaying import (
    DOUBLER,
    all_is_well,
    as_before,
    hears_on,
    runs,
)
from tests.adaptation.system import System
from tests.support.waiting import wait_until

CHANGES: tuple[Change, ...] = (SetParameters("fragile", {"level": 3}), DOUBLER)
POINTS = [
    *[("begin", 1, when) for when in ("before", "after")],
    *[("perform", call, when) for call in (1, 2, 3) for when in ("before", "after")],
    *[(name, 1, when) for name in ("succeed", "let_speak") for when in ("before", "after")],
    *[("progress", call, when) for call in (1, 2) for when in ("before", "after")],
    ("begin_giving", 1, "before"),
    ("begin_giving", 1, "after"),
    ("end", 1, "before"),
]


@pytest.mark.parametrize(("name", "call", "when"), POINTS)
def test_an_interrupted_swap_is_undone_on_return(
    site: System, monkeypatch: pytest.MonkeyPatch, name: str, call: int, when: str
) -> None:
    run, before = site.running["totaller"], site.views()
    owner: Any = {"perform": transaction, "begin_giving": Hosts, "succeed": Hosts, "let_speak": Hosts}.get(
        name, Journal
    )
    with monkeypatch.context() as patch:
        dying(patch, owner, name, call, when)
        pending = site.adapt(*CHANGES, wait=False)
        wait_until(lambda: not site.running["manager"].thread.is_alive())
    hears_on(site)
    site.start_manager()
    if (name, when) != ("begin", "before"):
        (line,) = site.lines(id=pending.id).entries
        assert (line.outcome, line.error) == (Outcome.ROLLED_BACK, "interrupted: the manager was restarted")
    as_before(site, run, before)
    assert site.adapt(*CHANGES).outcome is Outcome.APPLIED
    all_is_well(site)


@pytest.mark.parametrize(("owner", "name", "when"), [(Journal, "end", "after"), (Hosts, "stop", "before")])
def test_the_run_of_before_ends_even_if_the_manager_dies_right_after(
    site: System, monkeypatch: pytest.MonkeyPatch, owner: Any, name: str, when: str
) -> None:
    with monkeypatch.context() as patch:
        dying(patch, owner, name, 1, when)
        pending = site.adapt(DOUBLER, wait=False)
        wait_until(lambda: not site.running["manager"].thread.is_alive())
    hears_on(site)
    site.start_manager()
    (line,) = site.lines(id=pending.id).entries
    assert line.outcome is Outcome.APPLIED
    wait_until(lambda: runs(site) == [2])
    assert site.host.beside == {}
    all_is_well(site)
