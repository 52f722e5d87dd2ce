"""The generated modes are modes of a real stack: each can be entered and left, and is what really runs."""

from __future__ import annotations

import pytest

from regraft.bus_schema.messages.management.modes import MODES, ModesRequest, SystemModes
from regraft.bus_schema.model.adaptation import AdaptationReport, AdaptationRequest, EnterMode, Outcome
from tests.metacontrol.patrol.running import REST, SKILL, Patrol
from tests.metacontrol.patrol.stacks import REALIZATIONS
from tests.support.waiting import PATIENCE

pytestmark = pytest.mark.slow


def test_each_mode_is_entered_left_and_inferred(patrol: Patrol) -> None:
    for name in (REST, *REALIZATIONS, REST, *reversed(REALIZATIONS), REST):
        request = AdaptationRequest((EnterMode(f"{SKILL}.{name}"),), "trying it")
        report = patrol.client.call("adaptation_manager/adapt", request, AdaptationReport, PATIENCE)
        assert report.outcome is Outcome.APPLIED, report
        found = patrol.client.call(MODES, ModesRequest(reachable=True), SystemModes, PATIENCE)
        part = found.part(SKILL)
        assert part is not None
        assert (part.target, part.actual, part.as_asked) == (f"{SKILL}.{name}", f"{SKILL}.{name}", True)
        assert patrol.really() == {name}
        assert [mode.mode for mode in part.modes if not mode.reachable] == []
