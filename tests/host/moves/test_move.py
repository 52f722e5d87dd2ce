"""Components are moved to another host while the system runs: nothing is lost, and nobody notices."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from regraft.bus_schema.messages.management.manager import CancelAdaptation
from regraft.bus_schema.model.adaptation import AdaptationReport, Outcome, SetParameters
from tests.host.moves.moving import HOME, TO_EDGE, Ask, Item, Moving
from tests.host.several import Site
from tests.support.machine.processes import children_of, exists
from tests.support.systems import home
from tests.support.waiting import PATIENCE, wait_until

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def moving(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Moving]:
    """Return the stream, with the host edge."""
    folder = tmp_path_factory.mktemp("moving")
    with home(folder / "home"):
        site = Site(folder)
        made = Moving(site)
        made.join()
        made.wait_flowing()
        yield made
        site.close()


def test_a_component_goes_on_at_another_host_and_comes_back_and_nobody_misses_anything(moving: Moving) -> None:
    guest = moving.site.guests[0]
    goal = moving.system.client.goal("walk", Ask(300), Item, Item)
    before = moving.wait_alone("local")
    report = moving.adapt(TO_EDGE)
    assert report.outcome is Outcome.APPLIED, report
    assert [step.action for step in report.steps] == ["start it on edge beside that on local", "hand over to edge"]
    there = moving.wait_alone("edge")
    assert not exists(before.pid)
    assert there.pid in children_of(guest.process.pid)
    moving.check()
    assert moving.system.client.view("totaller").parameters["offset"] == 3
    assert moving.adapt(SetParameters("totaller", {"offset": 4})).outcome is Outcome.APPLIED

    back = moving.adapt(HOME)
    assert back.outcome is Outcome.APPLIED, back
    moving.wait_alone("local")
    assert not exists(there.pid)
    moving.check()
    assert moving.system.client.view("totaller").parameters["offset"] == 4
    assert goal.result(PATIENCE) == Item(300)

    undone = moving.undo(back)
    assert undone.outcome is Outcome.APPLIED, undone
    moving.wait_alone("edge")
    moving.check()
    assert moving.adapt(HOME).outcome is Outcome.APPLIED
    moving.wait_alone("local")


def test_a_move_that_is_not_confirmed_hands_the_living_state_back_to_the_process_of_before(moving: Moving) -> None:
    before = moving.wait_alone("local")
    held = moving.adapt(TO_EDGE, confirm=60.0, wait=False)
    wait_until(lambda: [at for at, speaks, _ in moving.runs() if speaks] == ["edge"], "the run on edge to speak")
    wait_until(lambda: moving.site.journal()[0].outcome is Outcome.CONFIRMING, "it to be confirmed")
    moving.hears_on()
    assert exists(before.pid), "it is frozen, not ended"
    cancel = CancelAdaptation(held.id)
    cancelled = moving.system.client.call("adaptation_manager/cancel", cancel, AdaptationReport, PATIENCE)
    assert cancelled.outcome is Outcome.CANCELLED, cancelled
    assert moving.wait_alone("local").pid == before.pid
    moving.check()
