"""``regraft objective``, to a metacontroller that runs as a process of its own."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.cli.live import Done, System, regraft

HERE = Path(__file__).parent
FILE = """\
objectives:
  - skill: to_navigate
    name: one
    requirements: {safety: 0.8}
    task: patrol
  - skill: to_detect
    name: two
    task: patrol
"""


@pytest.fixture(scope="module")
def running(tmp_path_factory: pytest.TempPathFactory) -> Iterator[System]:
    """Run a metacontroller."""
    command = ("up", str(HERE / "stack.yaml"), "--headless")
    with System(tmp_path_factory.mktemp("home"), command=command) as system:
        yield system


@pytest.fixture
def system(running: System) -> Iterator[System]:
    """Return the system, without objectives before and after."""
    yield running
    for each in running.ask("objective", "list")["objectives"]:
        running.ask("objective", "cancel", each["objective"])
    running.ask("objective", "context", "Default")


def objective(system: System, *words: str) -> Done:
    """Run ``regraft objective``."""
    return regraft(system.home, "objective", *words)


def test_an_objective_is_provided_by_a_realization_that_meets_its_bounds(system: System) -> None:
    done = objective(system, "add", "to_navigate", "safety>=0.8", "energy=0.5", "--name", "patrol_1")
    assert done.returncode == 0, done
    assert done.stdout.splitlines() == [
        "objective  skill        state        realization  mode                 progress    task",
        "patrol_1   to_navigate  IN_PROGRESS  careful      to_navigate.careful  INPROGRESS",
    ]


def test_an_objective_is_shown_with_what_is_required_measured_and_expected(system: System) -> None:
    system.ask("objective", "add", "to_navigate", "safety=0.8", "--task", "patrol", "--priority", "2")
    lines = objective(system, "show", "to_navigate").stdout.splitlines()
    assert lines[:4] == ["objective: to_navigate", "skill: to_navigate", "task: patrol", "state: IN_PROGRESS"]
    assert lines[4].startswith("realization: careful, for ")
    assert lines[5:] == [
        "mode: to_navigate.careful",
        "why: careful is the first that meets the bounds",
        "progress: INPROGRESS",
        "priority: 2",
        "always improve: no",
        "context: Default",
        "quality  required  measured  expected",
        "energy                       0.4",
        "safety   0.8       0.9       0.9",
    ]
    shown = system.ask("objective", "show", "to_navigate")["objectives"][0]
    assert (shown["state"], shown["priority"], shown["requirements"]) == ("IN_PROGRESS", 2.0, {"safety": 0.8})


def test_all_that_an_objective_may_have_is_typed(system: System) -> None:
    words = (
        *("add", "to_navigate", "--name", "all", "--always-improve", "--realization", "fast", "--weight", "safety=2"),
        *("--weight", "energy=0.5", "--curve", "safety=0:0,0.5:0.2,1:1", "--input", "goal={x: 1, y: 2}"),
        *("--input", "rounds=3", "--task", "patrol", "--priority", "1.5"),
    )
    assert system.ask("objective", *words)["objectives"][0]["always_improve"] is True
    # Equal content is that objective; the same name with another weight is refused.
    assert objective(system, *words).returncode == 0
    other = objective(system, *(word.replace("energy=0.5", "energy=0.6") for word in words))
    assert (other.returncode, "another objective 'all'" in other.stderr) == (1, True), other


def test_an_objective_that_nothing_provides_is_kept_and_the_command_fails(system: System) -> None:
    done = objective(system, "add", "to_navigate", "safety=0.99", "--name", "impossible")
    assert done.returncode == 1
    assert done.stderr == (
        "regraft: impossible is accepted, and nothing provides it now: no realization meets the bounds\n"
    )
    assert system.ask("objective", "show", "impossible")["objectives"][0]["state"] == "IN_ERROR_NFR"
    assert objective(system, "add", "to_detect", "safety=0.99", "--no-wait").returncode == 0


def test_a_file_adds_all_of_its_objectives_or_none(system: System, tmp_path: Path) -> None:
    file = tmp_path / "objectives.yaml"
    file.write_text(FILE)
    assert [each["objective"] for each in system.ask("objective", "add", "--file", str(file))["objectives"]] == [
        "one",
        "two",
    ]
    file.write_text(FILE.replace("name: ", "name: other_").replace("to_detect", "to_detekt"))
    refused = objective(system, "add", "--file", str(file))
    assert refused.returncode == 2
    place = f"{file}:6: objectives.1.skill"
    assert refused.stderr == f"regraft: {place}: there is no skill 'to_detekt'; did you mean 'to_detect'?\n"
    assert len(system.ask("objective", "list")["objectives"]) == 2
    file.write_text("skill: to_navigate\nname: alone\n")
    assert system.ask("objective", "add", "--file", str(file))["objectives"][0]["objective"] == "alone"


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("skill: to_navigate\nnmae: one\n", "2: there is no field 'nmae'; did you mean 'name'?"),
        ("skill: to_navigate\nrequirements:\n  safety: high\n", "3: requirements.safety: "),
        ("skill: to_navigate\noperators:\n  safety: '>'\n", "3: operators.safety: "),
        ("objectives:\n  - skill: to_navigate\n    priority: first\n", "3: priority: "),
        ("objectives: []\n", "1: objectives: must be a list of 1 to 100 objectives"),
        ("objectives: [{skill: to_navigate}]\nactor: me\n", "2: there is no field 'actor'"),
        ("- skill: to_navigate\n", "is a list, must be an objective"),
        ("name: one\n", "skill"),
    ],
)
def test_a_mistake_in_a_file_is_reported_with_file_and_line(
    system: System, tmp_path: Path, text: str, reason: str
) -> None:
    file = tmp_path / "objectives.yaml"
    file.write_text(text)
    refused = objective(system, "add", "--file", str(file))
    assert refused.returncode == 2
    assert reason in refused.stderr
    assert str(file) in refused.stderr
    assert system.ask("objective", "list")["objectives"] == []


@pytest.mark.parametrize(
    ("words", "reason"),
    [
        ("add", "name a SKILL, or a --file with objectives"),
        ("add to_navigate --file x.yaml", "--file has all of the objectives"),
        ("add --task a --file x.yaml", "--file has all of the objectives"),
        ("add to_navigat", "skill: there is no skill 'to_navigat'; did you mean 'to_navigate'?"),
        ("add to_navigate safty=0.5", "there is no quality 'safty'; did you mean 'safety'?"),
        ("add to_navigate safety", "'safety' must look like QUALITY>=NUMBER, QUALITY<=NUMBER or QUALITY=NUMBER"),
        ("add to_navigate safety>0.5", "safety: '>' compares no bound: must be >=, <= or ="),
        ("add to_navigate safety=high", "safety: 'high' is not a number"),
        ("add to_navigate safety=inf", "safety: inf is not finite"),
        ("add to_navigate safety=0.5 safety>=0.6", "safety: has two numbers: leave one out"),
        ("add to_navigate safety<=0.5", "<= contradicts the direction of safety: must be >="),
        ("add to_navigate --weight safety=much", "--weight safety: 'much' must be a finite number"),
        ("add to_navigate --weight safety=true", "--weight safety: True must be a finite number"),
        ("add to_navigate --weight safety", "must look like name=value"),
        ("add to_navigate --curve safety=0:0,1", "--curve safety: '1' must look like VALUE:UTILITY"),
        ("add to_navigate --curve safety", "must look like QUALITY=VALUE:UTILITY"),
        ("add to_navigate --curve a=0:0 --curve a=0:1", "--curve a: is given twice"),
        ("add to_navigate --input goal=1 --input goal=2", "--input goal: is given twice"),
        ("add to_navigate --priority inf", "priority"),
        ("show nothing", "there is no objective 'nothing'"),
        ("explain nothing", "there is no objective 'nothing'"),
        ("cancel nothing", "there is no objective 'nothing'"),
        ("cancel", "name either an OBJECTIVE or a --task"),
        ("cancel one --task two", "name either an OBJECTIVE or a --task"),
        ("cancel --task nothing", "there is no task 'nothing'"),
        ("context Darc", "there is no context 'Darc'; did you mean 'Dark'?"),
        ("report nothing OK", "there is no objective 'nothing'"),
        ("list --planner metacontrl", "there is no metacontroller 'metacontrl'; did you mean 'metacontrol'?"),
        ("list --robot left", "there is no robot 'left'"),
    ],
)
def test_a_mistake_is_named_with_what_would_be_right(system: System, words: str, reason: str) -> None:
    refused = objective(system, *words.split())
    assert refused.returncode == 2, refused
    assert reason in refused.stderr
    assert refused.stdout == ""
    assert system.ask("objective", "list")["objectives"] == []


def test_a_decision_is_explained(system: System) -> None:
    system.ask("objective", "add", "to_navigate")
    assert objective(system, "explain", "to_navigate").stdout.startswith("to_navigate: fast (IN_PROGRESS)\n  among")
    assert system.ask("objective", "explain", "to_navigate")["decision"] == {"design": "fast"}


def test_objectives_end_by_name_by_task_or_by_their_result(system: System, tmp_path: Path) -> None:
    file = tmp_path / "objectives.yaml"
    file.write_text(FILE)
    system.ask("objective", "add", "--file", str(file))
    system.ask("objective", "add", "to_navigate")
    system.ask("objective", "add", "to_navigate", "--name", "three")
    assert objective(system, "cancel", "--task", "patrol").stdout == "the task patrol is cancelled\n"
    assert objective(system, "cancel", "three").stdout == "three is cancelled\n"
    assert objective(system, "report", "to_navigate", "near").stdout == "to_navigate: INPROGRESS\n"
    wrong = objective(system, "report", "to_navigate", "OKAY")
    assert (wrong.returncode, "there is no result 'OKAY'" in wrong.stderr) == (2, True)
    assert objective(system, "report", "to_navigate", "SUCCESS").stdout == "to_navigate: SUCCESS, ended\n"
    assert objective(system, "list").stdout == "no objectives\n"


def test_the_context_is_shown_and_set(system: System) -> None:
    assert objective(system, "context").stdout.splitlines() == ["context  present", "Dark", "Default  yes"]
    assert objective(system, "context", "Dark").stdout == "the context is Dark; it was Default\n"
    assert system.ask("objective", "context") == {"context": "Dark", "contexts": ["Default", "Dark"]}
