"""After a kill in the middle of a switch, just one realization runs, and all of it."""

from __future__ import annotations

from collections import Counter

import pytest

from regraft.bus_schema.messages.management.manager import JournalPage, JournalRequest
from regraft.bus_schema.model.adaptation import JOURNAL, Outcome
from tests.metacontrol.patrol.killing import switch_through_kills
from tests.metacontrol.patrol.running import Patrol
from tests.support.waiting import PATIENCE

pytestmark = pytest.mark.slow


@pytest.mark.parametrize("kills", [4, pytest.param(20, marks=[pytest.mark.evidence, pytest.mark.timeout(1800)])])
def test_a_kill_in_a_switch_leaves_no_half_mode(patrol: Patrol, kills: int) -> None:
    struck = switch_through_kills(patrol, kills)
    page = patrol.client.call(JOURNAL, JournalRequest(limit=500), JournalPage, PATIENCE)
    outcomes = Counter(line.outcome for line in page.entries if line.request.actor == "metacontrol")
    print(
        f"{kills} kills: {', '.join(f'{each.value} {number}' for each, number in outcomes.items())}", *struck, sep="\n"
    )
    assert Outcome.STUCK not in outcomes
    assert not [event for event in patrol.events if event.kind == "metacontrol.objective_lost"]
