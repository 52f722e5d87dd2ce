"""The manager that chooses modes at random: how often it chooses, among what, and that equal seeds choose alike."""

from __future__ import annotations

from collections import Counter

import pytest

from regraft import Component, RequestRefused, service
from regraft.adaptation_manager.planners.modes.random_manager import RandomManager
from regraft.bus_schema.model.adaptation import ADAPT, AdaptationReport, AdaptationRequest, EnterMode
from regraft.bus_schema.model.lifecycle import State, Transition
from regraft.runtime.lifecycle.lifecycle import TransitionFailed
from regraft.testing import Rig


class Refusing(Component):
    """Takes requests down and refuses each of them: the next choice comes all the same."""

    def on_configure(self) -> None:
        """Begin without a request."""
        self.asked: list[tuple[float, str]] = []

    @service(ADAPT)
    def adapt(self, request: AdaptationRequest) -> AdaptationReport:
        """Refuse it."""
        (change,) = request.changes
        assert isinstance(change, EnterMode)
        self.asked.append((round(self.kit.now(), 1), change.mode))
        raise RequestRefused("nothing is adapted here")


def chosen(seconds: float, seed: int = 0, **parameters: object) -> list[tuple[float, str]]:
    """Return when a manager asks for which mode within some seconds. A request may wait for a second in the rig."""
    with Rig(seed=seed) as rig:
        manager = rig.add(Refusing)
        rig.add(RandomManager, parameters=parameters)
        rig.advance(seconds)
        return manager.asked


def test_a_mode_is_chosen_every_period_also_after_a_refusal() -> None:
    found = chosen(65.0, modes=["m.a"])
    assert [mode for _, mode in found] == ["m.a"] * 3
    assert found[0][0] >= 20.0


def test_the_first_choice_may_come_at_once() -> None:
    (first, _), *others = chosen(65.0, modes=["m.a"], period=30.0, first_after=0.0)
    assert first < 5.0
    assert len(others) == 2


def test_equal_seeds_choose_alike_and_others_do_not() -> None:
    modes = ["m.a", "m.b", "m.c"]
    assert chosen(400.0, 7, modes=modes) == chosen(400.0, 7, modes=modes)
    assert chosen(400.0, 7, modes=modes) != chosen(400.0, 8, modes=modes)


def test_a_mode_that_is_listed_twice_is_chosen_twice_as_often() -> None:
    counts = Counter(mode for _, mode in chosen(600.0, modes=["m.a", "m.b", "m.b"], period=0.5))
    assert 0.55 < counts["m.b"] / counts.total() < 0.80


def test_a_choice_among_nothing_is_refused() -> None:
    with Rig() as rig:
        rig.add(RandomManager, "chance", {"modes": []}, state=State.UNCONFIGURED)
        with pytest.raises(TransitionFailed, match="names no mode"):
            rig.transition("chance", Transition.CONFIGURE)
        assert len(rig.take_faults()) == 1
