"""A run that continues knows the objectives of the one before, and to whom they belong."""

from __future__ import annotations

from pathlib import Path

import pytest

from regraft.adaptation_manager.planners.metacontrol.control.store import ObjectiveStore
from regraft.adaptation_manager.planners.metacontrol.control.translation import Translator
from regraft.adaptation_manager.planners.metacontrol.knowledge.knowledge_base import load
from regraft.adaptation_manager.planners.metacontrol.reasoning.analysis import Analyser
from regraft.bus_schema.messages.management.objectives import Objective
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
