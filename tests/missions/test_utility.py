"""The formulas of FROG's missions and decision files are those of its utility, and so are the navigator's estimates."""

from __future__ import annotations

import json
import re
import xml.etree.ElementTree as ElementTree
from typing import Any

import pytest
import yaml

from behavior_tree.data.blackboard import Blackboard
from behavior_tree.script import compile_script
from regraft.bus_schema.model.expressions import Expression
from regraft.services.navigator.navigator import Navigator
from regraft.stacks.frog.utility import BUDGET, FASTEST, NEAR, driving_reward, driving_utility, moves_safely
from tests.missions.robot import MISSIONS, STACKS

GRID = [(near, speed / 100) for near in (0.2, 0.45, 0.4581, 0.46, 2.0) for speed in range(27)]
"""Nearest echoes (m) and speeds (m/s)."""
PLANS = MISSIONS / "plans"


def attribute(file: str, name: str) -> str:
    """Return the one attribute of that name in a file of plans."""
    (found,) = [node.attrib[name] for node in ElementTree.parse(PLANS / file).iter() if name in node.attrib]
    return found


@pytest.mark.parametrize("file", ["speed_external.xml", "speed_external_common.xml"])
def test_the_reward_of_the_external_strategies_is_the_utility(file: str) -> None:
    for nearest, speed in GRID:
        board = Blackboard()
        for name, value in (("safely", "satisfied" if moves_safely(nearest, speed) else "violated"), ("speed", speed)):
            board.set(name, value)
        script = compile_script(attribute(file, "utility").replace("@", ""), board, {})
        assert script() == pytest.approx(driving_reward(nearest, speed), abs=2e-4), (nearest, speed)


def test_the_decision_file_measures_the_utility() -> None:
    decision = yaml.safe_load((STACKS / "decisions" / "speed.yaml").read_text())
    for nearest, speed in GRID:
        names: dict[str, Any] = {"nearest": nearest, "speed": speed}
        qualities = {name: Expression(each["measured"]).number(names) for name, each in decision["qualities"].items()}
        utility = Expression(decision["objective"]["utility"]).number(qualities)
        assert utility == pytest.approx(driving_reward(nearest, speed), abs=2e-4), (nearest, speed)


def test_the_forecast_expects_the_utility_of_an_option_and_less_than_of_a_safe_one_where_it_is_not_safe() -> None:
    knobs = json.loads(attribute("forecast_drive.xml", "knobs").removeprefix("json:"))

    def expected(nearest: float, speed: float) -> float:
        # By the next choice it will have driven on for 0.1 s.
        context = {"nearest": nearest + 0.1 * speed, "navigator.max_velocity": speed}
        near = Expression(knobs["assume"]["near"]).number(context)
        assert bool(near) == (nearest < NEAR)
        estimate = Navigator.estimate({"max_velocity": speed}, {"near": near})
        return Expression(knobs["utility"]).number({f"navigator.{name}": value for name, value in estimate.items()})

    for nearest, speed in ((near, speed) for near, speed in GRID if speed > 0.0):
        if moves_safely(nearest, speed):
            assert expected(nearest, speed) == pytest.approx(driving_utility(nearest, speed) * FASTEST)
        else:  # The navigator expects to be slower than it may be for a part of the time.
            assert expected(nearest, speed) < expected(nearest, 0.17)


def test_the_forecast_pays_for_pictures_out_of_the_same_budget() -> None:
    knobs = attribute("forecast_look.xml", "knobs")
    assert [float(number) for number in re.findall(r"> (\d{4})", knobs)] == [pytest.approx(BUDGET)]
