"""Deaths at each step of a mode's adaptation, in simulated time: no revision is half a mode."""

from __future__ import annotations

from pathlib import Path

import pytest

from regraft.bus_schema.messages.management.manager import ArchitectureRequest
from regraft.bus_schema.model.adaptation import ARCHITECTURE
from regraft.bus_schema.model.architecture import Architecture
from tests.adaptation.system import System
from tests.modes.in_memory import MANAGER, PLANNER, STACK, Director, perform, running
from tests.modes.parts import Killer
from tests.modes.stacks import MODES, RULES
from tests.modes.wholes import whole_modes
from tests.support.waiting import PATIENCE

pytestmark = pytest.mark.slow

ONCE = STACK.replace("failures: 0", "failures: 1") + MODES + RULES
DEGRADING, RETURNING = 0.5, 2.0
"""Times at which the next mode that is entered is the degraded, or the normal one."""
STEPS = [
    (DEGRADING, "driver set"),
    (DEGRADING, "lamp activate"),
    (RETURNING, "laser configure"),
    (RETURNING, "laser activate"),
    (RETURNING, "driver set"),
    (RETURNING, "lamp deactivate"),
]


def _no_revision_is_half_a_mode(system: System) -> None:
    page = system.lines(limit=200)
    assert not [line for line in page.entries if line.outcome.value == "stuck"], page.entries
    for revision in sorted({line.revision_after for line in page.entries}):
        found = system.client.call(ARCHITECTURE, ArchitectureRequest(revision), Architecture, PATIENCE)
        whole = whole_modes(found)
        assert len(whole) == 1, (revision, found)
        assert found.asked_modes in ({}, {"": whole[0]})


@pytest.mark.parametrize("victim", [MANAGER, PLANNER, "laser"])
@pytest.mark.parametrize(("begin", "step"), STEPS, ids=[f"{step} at {begin:g} s" for begin, step in STEPS])
def test_whoever_dies_at_whichever_step_there_is_never_half_a_mode(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, victim: str, begin: float, step: str
) -> None:
    struck: list[str] = []

    async def script(director: Director) -> None:
        def strike(at: str) -> None:
            if at == step and not struck:
                struck.append(at)
                director.strike(victim)

        await director.until(begin)
        monkeypatch.setattr(Killer, "strike", staticmethod(strike))
        while not director.restarted:
            await director.kit.sleep(0.1)
        await director.kit.sleep(8.0)
        modes = await director.modes()
        assert (modes.target, modes.actual, modes.as_asked) == ("normal", "normal", True)

    with running(tmp_path, ONCE, script) as system:
        perform(system)
        _no_revision_is_half_a_mode(system)
        assert not [event for event in system.events if event.kind == "modes.manual"]
