"""Others act at the same time: goals of several clients, and adaptations that make a decision outdated."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from regraft.adaptation_manager.planners.manager_client import Manager
from regraft.bus_schema.messages.health import Level
from regraft.bus_schema.messages.management.objectives import CONTEXT_STATUS
from regraft.bus_schema.model.architecture import Architecture
from tests.metacontrol.control.bench import PATROL, perform
from tests.metacontrol.control.parts import Director


def test_an_objective_of_two_goals_ends_with_the_last_of_them(tmp_path: Path) -> None:
    async def script(director: Director) -> None:
        one, two = director.pursue(PATROL), director.pursue(PATROL)
        await director.wait(1.0)
        one.cancel()
        await director.wait(1.0)
        assert (await director.status("patrol")).realization == "normal"
        two.cancel()
        await director.wait(1.0)
        assert (await director.all()).objectives == ()

    perform(tmp_path, script)


def test_an_objective_that_was_also_added_outlives_its_goal(tmp_path: Path) -> None:
    async def script(director: Director) -> None:
        goal = director.pursue(PATROL)
        await director.wait(1.0)
        await director.add(PATROL)
        goal.cancel()
        await director.wait(1.0)
        assert (await director.status("patrol")).realization == "normal"
        await director.cancel("patrol")
        assert (await director.all()).objectives == ()

    perform(tmp_path, script)


def test_adaptations_of_others_that_outdate_a_decision_let_no_design_rest(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    whole = Manager.architecture
    outdated = [True]

    async def architecture(self: Manager, within: float) -> Architecture:
        found = await whole(self, within)
        return replace(found, revision=found.revision - 1) if outdated[0] else found

    monkeypatch.setattr(Manager, "architecture", architecture)

    async def script(director: Director) -> None:
        (status,) = (await director.add(PATROL)).objectives
        assert (status.realization, status.attempts) == ("", ())
        assert (await director.all()).resting == {}
        outdated[0] = False
        await director.wait(1.0)
        assert (await director.status("patrol")).realization == "normal"

    perform(tmp_path, script)


def test_contexts_that_change_all_the_time_without_designs_change_nothing(tmp_path: Path) -> None:
    contexts = ("Default", "OnChargingStation", "BatteryCharging", "Nonsense")

    async def script(director: Director) -> None:
        await director.add(PATROL)
        for number in range(60):
            director._diagnose(CONTEXT_STATUS, {"context": contexts[number % 4]}, "", Level.OK, None)
            await director.wait(0.02)
        assert len(await director.entered()) == 1
        assert (await director.status("patrol")).realization == "normal"

    perform(tmp_path, script)


def test_a_storm_of_implausible_diagnostics_makes_no_storm_of_events(tmp_path: Path) -> None:
    async def script(director: Director) -> None:
        await director.add(PATROL)
        for number in range(100):
            director.report("safety", 2.0 + number)
            await director.wait(0.02)
        assert len(await director.told("metacontrol.implausible")) <= 20
        assert (await director.status("patrol")).realization == "normal"

    perform(tmp_path, script)
