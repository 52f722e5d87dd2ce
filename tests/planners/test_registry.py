"""Strategies come in from other packages."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from importlib.metadata import EntryPoint
from random import Random

import pytest

from regraft.adaptation_manager.planners.bandits.strategy import Decision, Knobs, Offer, Strategy
from regraft.adaptation_manager.planners.bandits.strategy_registry import BadStrategy, Strategies
from regraft.bus_schema.annotations import PlainValue
from tests.planners.parts import bench

HERE = "tests.planners.test_registry"


@dataclass(frozen=True, slots=True)
class LastKnobs(Knobs):
    """No further knobs but one."""

    from_behind: int = 1


class Last(Strategy[LastKnobs]):
    """Chooses from behind."""

    name = "last"
    knobs_class = LastKnobs

    def choose(self, offer: Offer, rng: Random) -> Decision:
        return Decision(len(offer.keys) - self.knobs.from_behind, "it is last")

    def learn(self, key: str, utility: float, context: Mapping[str, float]) -> None: ...

    def state(self) -> PlainValue:
        return None

    def restore(self, state: PlainValue) -> None: ...


class Impostor(Last):
    """Has a name that is taken."""

    name = "ucb1"


def test_a_strategy_is_found_by_its_dotted_path() -> None:
    with bench(strategies=f"{HERE}:Last") as on:
        assert on.propose("last").choice["option"] == {"navigator.max_velocity": 0.26}
        assert on.propose("last", knobs={"from_behind": 3}).choice["option"] == {"navigator.max_velocity": 0.1}


def test_a_strategy_is_found_by_an_entry_point() -> None:
    found = Strategies(found=[EntryPoint("last", f"{HERE}:Last", "regraft.strategies")])
    assert found.names()[-1] == "last"
    assert found.describe()[-1].knobs["properties"]["from_behind"]["default"] == 1


@pytest.mark.parametrize(
    ("place", "said"),
    [
        (f"{HERE}:Missing", "must be module:Class"),
        ("nowhere.at_all:Last", "must be module:Class"),
        ("nonsense", "must be module:Class"),
        (f"{HERE}:LastKnobs", "is no Strategy"),
        (f"{HERE}:Impostor", "'ucb1', which is"),
    ],
)
def test_a_place_without_a_strategy_is_refused_by_name(place: str, said: str) -> None:
    with pytest.raises(BadStrategy, match=said) as refused:
        Strategies([place])
    assert place in str(refused.value)
