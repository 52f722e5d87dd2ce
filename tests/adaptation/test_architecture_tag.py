"""The tag of the architecture stands for one of its states: who knows that state need not read it again."""

from __future__ import annotations

from regraft.bus_schema.messages.management.manager import (
    ArchitectureTag,
    ArchitectureTagRequest,
    ConfirmAdaptation,
)
from regraft.bus_schema.model.adaptation import AdaptationReport, Outcome, SetParameters
from tests.adaptation.system import System
from tests.support.waiting import PATIENCE, wait_until

LOUDER = SetParameters("listener", {"gain": 0.9})


def _tag(system: System) -> str:
    request = ArchitectureTagRequest()
    return system.client.call("adaptation_manager/architecture_tag", request, ArchitectureTag, PATIENCE).tag


def test_each_state_of_the_architecture_has_a_tag_of_its_own(system: System) -> None:
    first = _tag(system)
    assert _tag(system) == first
    pending = system.adapt(LOUDER, wait=False, confirm=60.0)
    wait_until(lambda: system.lines(id=pending.id).entries[0].outcome is Outcome.CONFIRMING)
    unconfirmed = _tag(system)
    system.client.call("adaptation_manager/confirm", ConfirmAdaptation(pending.id), AdaptationReport, PATIENCE)
    wait_until(lambda: system.lines(id=pending.id).entries[0].outcome is Outcome.APPLIED)
    assert len({first, unconfirmed, _tag(system)}) == 3


def test_what_changes_nothing_keeps_the_tag(system: System) -> None:
    before = _tag(system)
    system.adapt(LOUDER, dry_run=True)
    assert system.adapt(SetParameters("listener", {"gain": "loud"})).outcome is Outcome.REJECTED
    assert _tag(system) == before
