"""Every command, with every kind of mistake in what is typed: exit code 2, one line with the nearest name, no trace."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import click
import pytest
import typer

from tests.authors.mistakes import MISSION_OPTIONS
from tests.cli.app import whole
from tests.cli.live import STACK, Done, System, regraft
from tests.executor.helpers import tree
from tests.support.tables import check_each

pytestmark = [pytest.mark.slow, pytest.mark.timeout(600)]

MORE = """\
  mission: {type: regraft/MissionStatus}

modes:
  loud: [{change: set_parameters, component: talker, parameters: {step: 2}}]

components:
  bt_executor: {class: 'regraft.services.bt_executor.executor:Executor'}
  bandits: {class: 'regraft.adaptation_manager.planners.bandits.bandit_planner:BanditPlanner', parameters: {seed: 7}}
  metacontrol: {class: 'tests.metacontrol.objectives.small_metacontroller:SmallMetacontroller'}
"""
TREE = tree('<Script code="rounds := 3"/>', '<Sleep name="wait" msec="100000000"/>', name="Patrol")
PROPOSAL = {
    "task": "talk",
    "inputs": {"strategy": "ucb1", "options": [{"component": "talker", "parameter": "step", "values": [1.0, 2.0]}]},
}

RIGHT: dict[str, str] = {
    "COMPONENT": "talker",
    "COMPONENT|MODULE:CLASS": "talker",
    "PARAMETER": "step",
    "PORT": "number",
    "TOPIC": "number",
    "HOST": "local",
    "CLASS": "tiny_parts:Talker",
    "TRANSITION": "deactivate",
    "PLANNER": "bandits",
    "BODY": "{value: 1}",
    "REVISION": "1",
    "STACK": str(STACK),
    "MODULE:CLASS": "tiny_parts:Talker",
    "FILE": "right",
    "SERVICE": "last_number",
    "ACTION": "wait_for",
    "PARAMETER VALUE | PARAMETER=VALUE...": "step=1",
    "NAME...": "local",
    "FOLDER": "certificates",
    "SKILL": "to_navigate",
    "OBJECTIVE": "patrol",
    "RESULT": "SUCCESS",
}
"""A right argument, by what stands for it in the help."""
PROPOSE = ("planner", "propose")

TALKER, STEP, NUMBER = "did you mean 'talker'?", "did you mean 'step'?", "did you mean 'number'?"
WRONG: dict[str, list[tuple[str, str]]] = {
    "COMPONENT": [("talkr", TALKER)],
    "COMPONENT|MODULE:CLASS": [("talkr", TALKER), ("tiny_part:Talker", "did you mean 'tiny_parts'?"), ("a:b:c", "")],
    "PARAMETER": [("stp", STEP)],
    "PARAMETER VALUE | PARAMETER=VALUE...": [
        ("stp=1", STEP),
        ("step=11", "must be at most 10.0 m"),
        ("step=fast", "must be a number"),
        ("step=1e400", "talker.step: 1e400 is too large for a number"),
        ("step", "name=value"),
    ],
    "PORT": [("nmber", NUMBER)],
    "TOPIC": [("numbr", NUMBER), ("a b", "'a b'")],
    "HOST": [("locl", "did you mean 'local'?")],
    "CLASS": [
        ("tiny_parts:Talkr", "did you mean 'Talker'?"),
        ("tiny_prts:Talker", "did you mean 'tiny_parts'?"),
        ("Talker", "must look like"),
    ],
    "TRANSITION": [("activat", "did you mean 'activate'?")],
    "PLANNER": [("bandit", "did you mean 'bandits'?")],
    "BODY": [("{vale: 1}", "has no field 'vale'"), ("{value: high}", "value"), ("{", "")],
    "REVISION": [("999", "there is no revision 999"), ("first", "must be a whole number")],
    "ID": [("999", "'999'")],
    "MODE": [("lod", "loud")],
    "PART": [("talkr", "a part is only named behind 'show'")],
    "SERVICE": [("last_numbr", "did you mean 'last_number'?")],
    "ACTION": [("wait_fr", "did you mean 'wait_for'?")],
    "FILE": [("nowhere", "nowhere"), ("nonsense", "")],
    "STACK": [(str(STACK)[:-1] + "l", f"did you mean '{STACK}'?")],
    "MODULE:CLASS": [("tiny_parts:Talkr", "'Talker'"), ("tiny_prts:Talker", "'tiny_parts'"), ("tiny_parts:Number", "")],
    "TYPE": [("regraft/Twits", "did you mean 'regraft/Twist'?")],
    "NAME": [("pge", "did you mean 'page'?")],
    "NODE": [("wiat", "did you mean 'wait'?")],
    "KEY": [("roundz", "did you mean 'rounds'?")],
    "KEY VALUE | KEY=VALUE...": [
        ("rounds=many", "'many' is not a whole number"),
        ("rounds=1e400", "rounds: 1e400 is"),
        ("rounds", "name=value"),
    ],
    "FILE...": [("nowhere", "nowhere")],
    "RECORDING": [("nowhere", "cannot be read"), ("nonsense", "must be a tree or the changes of a tick")],
    "PAGE...": [("nowhere", "nowhere")],
    "STUDY": [("frog-architectur", "did you mean 'frog-architecture'?")],
    "SYSTEM": [],
    "NAME...": [],
    "FOLDER": [],
    "SKILL": [("to_navigat", "did you mean 'to_navigate'?")],
    "QUALITY=NUMBER...": [
        ("safty=0.5", "did you mean 'safety'?"),
        ("safety=high", "safety: 'high' is not a number"),
        ("safety<=0.5", "<= contradicts the direction of safety"),
        ("safety", "must look like QUALITY>=NUMBER"),
    ],
    "OBJECTIVE": [("patrl", "did you mean 'patrol'?")],
    "CONTEXT": [("Darc", "did you mean 'Dark'?")],
    "RESULT": [("SUCESS", "did you mean 'SUCCESS'?")],
}
"""Its mistyped forms, with what is told then. A system that does not run is no mistake: exit code 3."""

NEEDED: dict[tuple[str, ...], tuple[str, ...]] = {
    ("evaluate", "join"): ("--out", "joined.csv"),
    ("skills", "generate"): ("--out", "generated"),
    ("skills", "kb", "query"): ("--sparql", "ASK { ?design a tomasys:FunctionDesign }"),
    ("skills", "kb", "save"): ("--out", "saved.owl"),
}
"""Options without which a command is not complete."""

LISTS = (
    "ps",
    "mode",
    "param list",
    "lifecycle list",
    "topic list",
    "service list",
    "action list",
    "planner list",
    "objective list",
    "events",
)
"""Commands that show what belongs to one robot."""
OPTIONS: list[tuple[str, str]] = [
    ("up STACK --set talkr.step=1", TALKER),
    ("up STACK --set talker.stp=1", STEP),
    ("up STACK --set talker.step=11", "must be at most 10"),
    ("up STACK --place talkr=local", TALKER),
    ("up STACK --speed rael", "did you mean 'real'?"),
    ("run tiny_parts:Talker --set stp=1", STEP),
    ("run tiny_parts:Talker --set step=11", "must be at most 10"),
    ("run tiny_parts:Talker --connect nmber=number", NUMBER),
    ("swap talker -p stp=1", STEP),
    ("swap talker -p step=11", "must be at most 10.0 m"),
    ("swap talker -p step=1e400", "--set step: 1e400 is too large for a number"),
    ("swap talker -p step=1 -p step=2", "--set step: is given twice"),
    ("swap talker tiny_parts:Listener -p step=1", "talker has no parameter 'step'; there are: offset"),
    ("swap talker --connect nmber=spare", NUMBER),
    ("swap talker --connect number=spair", "did you mean 'spare'?"),
    ("swap talker --host locl", "did you mean 'local'?"),
    ("remove listener --topic spair", "did you mean 'spare'?"),
    ("connect listener number architecture", "takes clitest/Number, but topic 'architecture' carries"),
    ("estimate talker --set stp=1", STEP),
    ("estimate talker --set step=11", "must be at most 10"),
    ("estimate talker --set step=1e400", "--set step: 1e400 is too large for a number"),
    ("run tiny_parts:Talker --set step=1e400", "--set step: 1e400 is too large for a number"),
    ("up STACK --set talker.step=1e400", "talker.step=1e400: 1e400 is too large for a number"),
    ("estimate tiny_parts:Talker --set stp=1", STEP),
    ("topic pub number {value:1} --type clitest/Nmber", "number carries clitest/Number"),
    ("topic pub elsewhere {value:1} --type clitest/Nmber", "clitest/Nmber"),
    ("mode loud --from modes.yaml", "modes.yaml"),
    *MISSION_OPTIONS,
    ("journal --before last", "'last'"),
    ("types --import tiny_prts", "did you mean 'tiny_parts'?"),
    ("evaluate frog-architecture --configurations basline", "did you mean"),
    ("evaluate frog-architecture --definitions publishd", "did you mean"),
    ("planner propose bandits unknown", "did you mean 'talker'?"),
    ("objective add --file nowhere", "nowhere: cannot be read"),
    ("objective list --planner metacontrl", "did you mean 'metacontrol'?"),
    *((f"{words} --robot left", "there is no robot 'left'; there are none") for words in LISTS),
    *(
        (f"mission {words} --robot left", "no robot or component 'left' runs missions")
        for words in ("show", "get", "halt")
    ),
]
"""Mistakes in options, and in what files hold."""

CHANGES: list[tuple[dict[str, Any], str]] = [
    ({"change": "set_parameters", "component": "talkr", "parameters": {"step": 1}}, TALKER),
    ({"change": "set_parameters", "component": "talker", "parameters": {"stp": 1}}, STEP),
    ({"change": "set_parameters", "component": "talker", "parameters": {"step": -1}}, "must be at least 0"),
    ({"change": "connect", "component": "listener", "port": "nmber", "topic": "spare"}, NUMBER),
    ({"change": "connect", "component": "listener", "port": "number", "topic": "spair"}, "did you mean 'spare'?"),
    ({"change": "transition", "component": "talkr", "transition": "activate"}, TALKER),
    ({"change": "transition", "component": "talker", "transition": "activat"}, "activate"),
    ({"change": "remove", "component": "talkr"}, TALKER),
    ({"change": "swap", "component": "talker", "class": "tiny_parts:Talkr"}, "did you mean 'Talker'?"),
    ({"change": "move", "component": "talker", "host": "locl"}, "did you mean 'local'?"),
    ({"change": "mode", "mode": "lod"}, "did you mean 'loud'?"),
    ({"change": "add", "component": "second", "spec": {"class": "tiny_parts:Listenr"}}, "did you mean 'Listener'?"),
    ({"change": "add", "component": "second", "spec": {"class": "tiny_prts:Listener"}}, "did you mean 'tiny_parts'?"),
    (
        {"change": "add", "component": "second", "spec": {"class": "tiny_parts:Listener", "parameters": {"ofset": 1}}},
        "did you mean 'offset'?",
    ),
    (
        {
            "change": "add",
            "component": "second",
            "spec": {"class": "tiny_parts:Listener", "connect": {"nmber": "spare"}},
        },
        NUMBER,
    ),
    ({"change": "add", "component": "second", "spec": {"class": "tiny_parts:Listener", "host": "locl"}}, "'local'?"),
    ({"change": "swop", "component": "talker"}, "swap"),
]


@pytest.fixture(scope="module")
def robot(tmp_path_factory: pytest.TempPathFactory) -> Iterator[System]:
    """Run the tiny stack with a mission executor, a planner and a mode, among files that are right and wrong."""
    folder = tmp_path_factory.mktemp("robot")
    topics, components = MORE.split("components:\n")
    text = (STACK / "stack.yaml").read_text().replace("\ncomponents:\n", f"{topics}components:\n{components}")
    (folder / "stack.yaml").write_text(text)
    (folder / "tiny_parts.py").write_text((STACK / "tiny_parts.py").read_text())
    (folder / "right").write_text(TREE)
    (folder / "nonsense").write_text("<root>: [")
    wrong = json.loads(json.dumps(PROPOSAL).replace("talker", "talkr"))
    (folder / "unknown").write_text(json.dumps(wrong))
    (folder / "proposal").write_text(json.dumps(PROPOSAL))
    with System(folder / "home", command=("up", str(folder), "--headless")) as system:
        system.ask("token", "create", "--role", "operate", "--for", "1h", "--name", "page")
        system.ask("mission", "load", str(folder / "right"))
        system.ask("mission", "start")
        system.ask("objective", "add", "to_navigate", "--name", "patrol")
        yield system


def commands(command: Any, *names: str) -> Iterator[tuple[tuple[str, ...], list[str]]]:
    """Yield every command with what stands for its arguments in the help."""
    if isinstance(command, click.Group) or hasattr(command, "commands"):
        for name, inner in command.commands.items():
            yield from commands(inner, *names, name)
        if not command.params:
            return
    arguments = [parameter for parameter in command.params if parameter.param_type_name == "argument"]
    yield names, [str(argument.metavar or argument.name.upper()).strip("[]") for argument in arguments]


COMMANDS = dict(commands(typer.main.get_command(whole())))


def generated() -> Iterator[tuple[tuple[str, ...], str]]:
    """Yield every command with one of its arguments mistyped and the others right, and what is told."""
    for names, places in COMMANDS.items():
        for at, place in enumerate(places):
            for wrong, told in WRONG[place]:
                right = RIGHT | {"FILE": "proposal"} if names == PROPOSE else RIGHT
                words = [wrong if index == at else right.get(other, "") for index, other in enumerate(places)]
                words = [word for index, word in enumerate(words) if word or index <= at]
                yield (*names, *words, *NEEDED.get(names, ())), told


def mistyped(robot: System, *words: str) -> Done:
    """Run a command where the files are; what it did must be nothing."""
    before = robot.ask("journal")
    done = regraft(robot.home, *words)
    assert robot.ask("journal") == before
    return done


def check(done: Done, told: str) -> None:
    """Check what a mistake gives."""
    assert done.returncode == 2, done
    assert told in done.stderr
    assert "Traceback" not in done.stderr
    assert done.stdout == ""
    assert len([line for line in done.stderr.splitlines() if line.startswith(("regraft: ", "Error: "))]) == 1


@pytest.fixture
def untouched(robot: System, monkeypatch: pytest.MonkeyPatch) -> Iterator[System]:
    """Return the robot, in the folder with the files; what the test did must have left no trace in its journal."""
    monkeypatch.chdir(robot.home.parent)
    before = robot.ask("journal")
    yield robot
    assert robot.ask("journal") == before


def test_every_mistyped_argument_exits_with_2_and_leaves_no_trace(untouched: System) -> None:
    check_each(generated(), lambda row: check(regraft(untouched.home, *row[0]), row[1]))


def test_every_mistyped_option_exits_with_2_and_leaves_no_trace(untouched: System) -> None:
    def refused(row: tuple[str, str]) -> None:
        check(regraft(untouched.home, *row[0].replace("STACK", str(STACK)).split()), row[1])

    check_each(OPTIONS, refused)


@pytest.mark.parametrize("more", [(), ("--dry-run",)], ids=["", "dry run"])
def test_every_mistyped_change_in_a_file_exits_with_2_and_leaves_no_trace(
    untouched: System, tmp_path: Path, more: tuple[str, ...]
) -> None:
    file = tmp_path / "request.json"

    def refused(row: tuple[dict[str, Any], str]) -> None:
        file.write_text(json.dumps({"changes": [row[0]]}))
        check(regraft(untouched.home, "adapt", str(file), *more), row[1])

    check_each(CHANGES, refused)


def test_every_mistake_of_a_request_is_told_at_once_by_its_change(untouched: System, tmp_path: Path) -> None:
    file = tmp_path / "request.json"
    file.write_text(json.dumps({"changes": [CHANGES[1][0], CHANGES[3][0]]}))
    done = regraft(untouched.home, "adapt", str(file))
    assert done.returncode == 2
    lines = done.stderr.splitlines()
    assert "change 0: talker has no parameter 'stp'" in lines[0]
    assert "change 1: listener has no port 'nmber'" in lines[1]


def test_each_change_of_a_request_sees_what_those_before_it_do(untouched: System, tmp_path: Path) -> None:
    file = tmp_path / "request.json"
    add = {"change": "add", "component": "second", "spec": {"class": "tiny_parts:Listener", "services": {
        "last_number": "second_number", "wait_for": "second_wait"}}}  # fmt: skip
    later = {"change": "set_parameters", "component": "second", "parameters": {"offset": 1}}
    file.write_text(json.dumps({"changes": [add, later]}))
    assert untouched.ask("adapt", str(file), "--dry-run")["outcome"] == "pending"
    later["parameters"] = {"ofset": 1}
    file.write_text(json.dumps({"changes": [add, later]}))
    check(regraft(untouched.home, "adapt", str(file)), "change 1: second has no parameter 'ofset'")


@pytest.mark.parametrize(
    "words",
    [
        ("lifecycle", "set", "talker", "configure"),
        ("remove", "adaptation_manager"),
        ("remove", "talker"),
        ("swap", "adaptation_manager"),
        ("connect", "talker", "number", "spare"),
    ],
    ids=" ".join,
)
def test_a_well_formed_change_that_is_rejected_exits_with_1_and_has_a_line(
    robot: System, words: tuple[str, ...]
) -> None:
    before = robot.ask("journal")["entries"][0]["id"]
    tried = regraft(robot.home, *words, "--dry-run")
    assert tried.returncode == 1
    assert robot.ask("journal")["entries"][0]["id"] == before
    assert regraft(robot.home, *words).returncode == 1
    line = robot.ask("journal")["entries"][0]
    assert (line["id"], line["outcome"]) == (str(int(before) + 1), "rejected")


@pytest.mark.parametrize(
    "words",
    [
        ("param", "set", "talker", "step=3"),
        ("connect", "listener", "number", "number"),
        ("lifecycle", "set", "listener", "deactivate"),
        ("remove", "listener"),
        ("swap", "talker"),
        ("mode", "loud"),
        ("undo",),
        ("journal", "undo"),
    ],
    ids=" ".join,
)
def test_a_dry_run_says_what_would_be_done_and_touches_nothing(robot: System, words: tuple[str, ...]) -> None:
    if words[-1] == "undo":
        words = (*words, robot.ask("param", "set", "talker", f"rate={21 + len(words)}")["id"])
    lines, components, values = robot.ask("journal"), robot.components(), robot.ask("param", "list")
    tried = robot.ask(*words, "--dry-run")
    assert tried["request"]["dry_run"]
    assert tried["outcome"] == "pending"
    assert tried["architecture"]["revision"] == tried["revision_after"]
    assert robot.ask("journal") == lines
    assert robot.ask("param", "list") == values
    assert {name: c["incarnation"] for name, c in robot.components().items()} == {
        name: c["incarnation"] for name, c in components.items()
    }


def test_what_is_asked_in_vain_exits_with_1(robot: System) -> None:
    robot.ask("mission", "halt")
    assert regraft(robot.home, "mission", "halt").returncode == 1
    robot.ask("mission", "start")
