"""Components whose host has not joined: lists show them without values, and commands about them exit with 3."""

from __future__ import annotations

import json
from collections.abc import Iterator

import pytest

from tests.cli.live import STACK, System, regraft

pytestmark = pytest.mark.slow

BANDITS = "regraft.adaptation_manager.planners.bandits.bandit_planner:BanditPlanner"
FAR = f"""\
  far: {{class: 'tiny_parts:Listener', host: edge, services: {{last_number: far_number, wait_for: far_wait}}}}
  bandits: {{class: '{BANDITS}', host: edge, parameters: {{seed: 7}}}}
hosts: [edge]
"""


@pytest.fixture(scope="module")
def partial(tmp_path_factory: pytest.TempPathFactory) -> Iterator[System]:
    """Run the tiny stack with a listener and a planner on a host that never joins."""
    folder = tmp_path_factory.mktemp("partial")
    (folder / "stack.yaml").write_text((STACK / "stack.yaml").read_text() + FAR)
    (folder / "tiny_parts.py").write_text((STACK / "tiny_parts.py").read_text())
    with System(folder / "home", command=("up", str(folder), "--headless"), ready="system tiny") as system:
        for name in ("talker", "listener", "adaptation_manager"):
            system.component_after(name, 0)
        yield system


def test_parameters_are_listed_also_of_a_component_that_is_absent(partial: System) -> None:
    rows = {(row["component"], row["parameter"]): row for row in partial.ask("param", "list")["parameters"]}
    assert (rows["talker", "step"]["value"], rows["talker", "step"]["error"]) == (1.0, "")
    far = rows["far", "offset"]
    assert (far["value"], far["default"]) == (None, 0.0)
    assert "'far' has no process now" in far["error"]
    done = regraft(partial.home, "param", "list")
    assert done.returncode == 0
    assert "far                 offset" in done.stdout
    assert done.stderr.count("'far' has no process now") == 1


def test_planners_are_listed_also_where_one_is_absent(partial: System) -> None:
    (found,) = partial.ask("planner", "list")["planners"]
    assert (found["planner"], found["component"], found["strategies"]) == ("bandits", "bandits", [])
    assert found["error"] != ""


def test_states_are_listed_also_of_a_component_that_is_absent(partial: System) -> None:
    rows = {row["component"]: row for row in partial.ask("lifecycle", "list")["components"]}
    assert sorted(rows) == ["adaptation_manager", "bandits", "far", "listener", "talker"]
    assert (rows["talker"]["state"], rows["talker"]["error"]) == ("active", "")
    assert (rows["far"]["state"], rows["far"]["transitions"]) == (None, [])
    assert "'far' has no process now" in rows["far"]["error"]


def test_nobody_joins_under_the_name_of_a_component_that_is_absent(partial: System) -> None:
    done = partial.join("tiny_parts:Listener", "--name", "far")
    assert done.ended() == 2, done.lines
    assert "tiny has a component 'far' already" in done.lines[-1]


@pytest.mark.parametrize(
    "words", [("param", "get", "far", "offset"), ("lifecycle", "get", "far"), ("estimate", "far")], ids=" ".join
)
def test_what_an_absent_component_would_answer_exits_with_3(partial: System, words: tuple[str, ...]) -> None:
    done = regraft(partial.home, *words, "--json")
    assert (done.returncode, done.stdout) == (3, "")
    error = json.loads(done.stderr)
    assert error["code"] == "not_reachable"
    assert "'far' has no process now" in error["error"]
