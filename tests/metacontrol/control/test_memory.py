"""A run that continues knows the objectives of the one before, and to whom they belong."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from regraft.adaptation_manager.planners.metacontrol.control.store import ObjectiveStore
from regraft.adaptation_manager.planners.metacontrol.control.translation import Translator
from regraft.adaptation_manager.planners.metacontrol.knowledge.knowledge_base import load
from regraft.adaptation_manager.planners.metacontrol.reasoning.analysis import Analyser
from regraft.bus.interface import Sample
from regraft.bus.memory_bus import MemoryBus
from regraft.bus_schema.encoding import codec
from regraft.bus_schema.keys import Keys
from regraft.bus_schema.messages.management.objectives import Objective
from regraft.bus_schema.messages.protocol.control import Snapshot
from regraft.bus_schema.model.adaptation import SetParameters
from tests.adaptation.system import SYSTEM
from tests.metacontrol.control.bench import PATROL, perform
from tests.metacontrol.control.parts import PLANNER, Director
from tests.metacontrol.owl import NAVIGATE, SAFETY, design, write


@pytest.fixture
def stores(tmp_path: Path) -> tuple[ObjectiveStore, ObjectiveStore]:
    """Return the objectives of a run, and those of the next."""
    model = Analyser(load([write(tmp_path, design("watch", NAVIGATE, {SAFETY: 0.9}))])).model
    return ObjectiveStore(Translator(model, None)), ObjectiveStore(Translator(model, None))


def test_a_cancelled_objective_ends_in_the_next_run_too_where_the_first_one_was_killed(
    stores: tuple[ObjectiveStore, ObjectiveStore],
) -> None:
    store, restarted = stores
    store.add([Objective("to_navigate")], "a goal")
    store["to_navigate"].release("a goal")
    assert store.over(0.0, 10.0) == ["to_navigate"]
    restarted.restore(store.remembered(), 0.0)
    assert restarted.over(10.0, 10.0) == ["to_navigate"]


def test_an_objective_of_a_client_waits_for_it_in_the_next_run(stores: tuple[ObjectiveStore, ObjectiveStore]) -> None:
    store, restarted = stores
    store.add([Objective("to_navigate")], "a goal")
    restarted.restore(store.remembered(), 0.0)
    restarted["to_navigate"].own("the same goal")
    assert restarted.over(100.0, 10.0) == []


def test_what_was_answered_while_the_manager_is_busy_outlives_a_crash(tmp_path: Path) -> None:
    async def script(director: Director) -> None:
        kept = _kept(director)
        await director.adapt(SetParameters("dock", {"speed": 0.3}), confirm=6.0, wait=False)
        await director.wait(0.2)
        await director.add(PATROL, wait=False)
        await director.until(1.0)
        assert _names(kept) == ["patrol"]
        await director.cancel("patrol", wait=False)
        assert _names(kept) == []
        await director.set_context("BatteryCharging")
        assert kept[-1]["monitor"]["context"] == "BatteryCharging"
        await director.add(replace(PATROL, name="added"), wait=False)
        assert _names(kept) == ["added"]
        director.pursue(replace(PATROL, name="pursued"))
        await director.wait(0.2)
        assert _names(kept) == ["added", "pursued"]
        await director.report_progress("added", "OK")
        assert _names(kept) == ["pursued"]
        assert await director.entered() == [], "the manager is busy"

    perform(tmp_path, script)


def _kept(director: Director) -> list[dict[str, Any]]:
    """Return the states that a host keeps of the metacontroller, as they come."""
    kept: list[dict[str, Any]] = []

    def take(sample: Sample) -> None:
        kept.append(codec.decode(sample.payload, Snapshot).state)

    MemoryBus(director.system.hub).subscribe(Keys(SYSTEM).checkpoint(PLANNER), take)
    return kept


def _names(kept: list[dict[str, Any]]) -> list[str]:
    return [each["given"]["name"] for each in kept[-1]["objectives"]]
