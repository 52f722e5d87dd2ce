"""A hundred moves there and back, at 1 kHz with a service and an action under way; and ten with pictures at 30 Hz."""

from __future__ import annotations

import pytest

from regraft.bus_schema.model.adaptation import Outcome
from tests.handover.parts import Ask, Item, Report
from tests.host.moves.moving import HOME, TO_EDGE, Moving
from tests.host.several import Site
from tests.support.waiting import PATIENCE

pytestmark = [pytest.mark.evidence, pytest.mark.alone, pytest.mark.timeout(900)]


def _gap(moving: Moving) -> float:
    """Return the longest time without a total since this was last asked, in milliseconds."""
    return 1000 * moving.system.client.call("report", Ask(1), Report, PATIENCE).gap


def _middle(values: list[float], part: float) -> float:
    return sorted(values)[min(len(values) - 1, int(part * len(values)))]


@pytest.mark.parametrize(("moves", "pictures"), [(100, False), (10, True)])
def test_there_and_back_again_and_again_without_losing_anything(site: Site, moves: int, pictures: bool) -> None:
    moving = Moving(site, pictures=pictures)
    moving.join()
    moving.wait_flowing()
    goal = moving.system.client.goal("walk", Ask(1_000_000), Item, Item)
    durations, gaps = [], []
    for number in range(moves):
        _gap(moving)
        report = moving.adapt(HOME if number % 2 else TO_EDGE)
        assert report.outcome is Outcome.APPLIED, report
        moving.hears_on()
        durations.append(1000 * report.duration)
        gaps.append(_gap(moving))
    assert not goal.done
    moving.wait_alone("local")
    moving.check()
    goal.cancel()
    if pictures:
        viewed = moving.system.client.call("viewed", Ask(), Item, PATIENCE)
        assert viewed.number > 30
        assert viewed.total == 0, "a picture was lost, doubled or wrong"
    for name, values in (("the move", durations), ("the longest gap", gaps)):
        shown = [f"{_middle(values, part):.0f}" for part in (0.5, 0.95, 1.0)]
        print(f"{moves} moves, {name}: {' / '.join(shown)} ms (median, 95th percentile, longest)")
