"""Stacks are checked, shown and drawn without running them."""

from __future__ import annotations

import json
import os
import sys
from pathlib import Path

import pytest

from regraft.stack import StackError, load
from tests.cli.conftest import Regraft
from tests.stack.reading.files import GOOD, line_of, write
from tests.stack.reading.folders import ROBOT, TWO, rovers
from tests.stack.robots.test_robot_data import ROBOT as DATA_OF_ROVER
from tests.stack.robots.test_robot_data import SINGLE as OF_ROVER
from tests.support.paths import ROOT

STACKS = ROOT / "regraft" / "stacks"


def test_a_good_stack_is_told_so(regraft: Regraft, tmp_path: Path) -> None:
    done = regraft("stack", "check", str(rovers(tmp_path)))
    assert (done.exit_code, done.output) == (
        0,
        f"{tmp_path}/stack.yaml: 5 components, 6 topics, 2 constraints, 2 modes: all right\n",
    )
    told = json.loads(regraft("stack", "check", str(tmp_path), "--json").output)
    assert told == {"system": "two", "components": 5, "topics": 6, "constraints": 2, "modes": 2}


def test_everything_that_is_wrong_is_told_and_is_a_mistake(regraft: Regraft, tmp_path: Path) -> None:
    robot = ROBOT.replace("beams: 90", "beams: $no").replace("rover.xml", "no.xml")
    done = regraft("stack", "check", str(rovers(tmp_path, robot=robot)))
    assert done.exit_code == 2
    assert done.stderr.count("robot.yaml:") == 4


def test_overrides_count_as_they_do_for_up(regraft: Regraft, tmp_path: Path) -> None:
    file = write(tmp_path, GOOD)
    (tmp_path / "params.yaml").write_text("world: {tick_rate: 0}\n")
    assert regraft("stack", "check", str(file), "--params", str(tmp_path / "params.yaml")).exit_code == 2
    options = ("--params", str(tmp_path / "params.yaml"), "--set", "world.tick_rate=20")
    assert regraft("stack", "check", str(file), *options).exit_code == 2
    assert regraft("stack", "check", str(file), "--place", "rescuer.navigator=edge").exit_code == 0


@pytest.mark.parametrize(
    "stack",
    ["frog/stack", "frog/rounds", "frog/explore", "frog/search", "frog/metacontrol", "patrol/rules", "suave/stack"],
)
def test_what_is_shown_of_a_stack_is_a_stack_file_of_the_same_system(
    regraft: Regraft, tmp_path: Path, stack: str
) -> None:
    file = STACKS / f"{stack}.yaml"
    shown = regraft("stack", "show", str(file))
    assert shown.exit_code == 0
    (tmp_path / "shown.yaml").write_text(shown.output)
    assert load(tmp_path / "shown.yaml").architecture == load(file).architecture


def test_what_is_shown_has_rules_of_modes_files_and_modes_that_enter_others(regraft: Regraft, tmp_path: Path) -> None:
    node = "{ros__parameters: {type: node, modes: {__DEFAULT__: {ros__parameters: {max_velocity: 0.2}}}}}"
    modes = "{__DEFAULT__: {rescuer/navigator: active}, OFF: {rescuer/navigator: inactive}}"
    rule = "{if_target: active.__DEFAULT__, if_part: [rescuer/navigator, inactive], new_target: active.OFF}"
    drive = f"{{ros__parameters: {{type: system, modes: {modes}, rules: {{stop: {rule}}}}}}}"
    (tmp_path / "modes.yaml").write_text(f"rescuer/navigator: {node}\ndrive: {drive}\n")
    topics = "topics:\n  adaptations: {type: regraft/AdaptationReport}\n  architecture: {type: regraft/Architecture}\n"
    managing = (
        "  modes: {class: 'regraft.adaptation_manager.planners.modes.mode_planner:ModePlanner'}\n"
        "  adaptation_manager: {class: 'regraft.adaptation_manager.manager:AdaptationManager'}\n"
    )
    stack = GOOD.replace("components:\n", f"components:\n{managing}", 1).replace("topics:\n", topics, 1)
    file = write(tmp_path, f"{stack}modes: modes.yaml\n")
    shown = regraft("stack", "show", str(file))
    assert shown.exit_code == 0, shown.output
    (tmp_path / "shown.yaml").write_text(shown.output)
    found, meant = load(tmp_path / "shown.yaml").architecture, load(file).architecture
    assert found == meant
    assert [found.mode_parts, [rule.name for rule in found.mode_rules]] == [
        {"drive.__DEFAULT__": ("rescuer/navigator.__DEFAULT__",)},
        ["drive.stop"],
    ]


def test_what_is_shown_of_robots_is_a_stack_file_of_the_same_system(regraft: Regraft, tmp_path: Path) -> None:
    file = rovers(tmp_path)
    values = "{a: $$x, b: 'no: \"1\"', c: '12', d: \"\\x07\", e: [1e3, -2]}"
    odd = f"  odd: {{command: [x, '', $$x], managed: false, parameters: {values}}}\n"
    lamp = "components:\n  lamp: {command: [lamp, $robot, $beams, $speed], managed: false}\n"
    (tmp_path / "rover" / "robot.yaml").write_text(ROBOT.replace("components:\n", lamp))
    file.write_text(f"{TWO}{odd}hosts: [edge]\nspeed: max\n")
    shown = regraft("stack", "show", str(file), "--place", "left.eyes=arm")
    (tmp_path / "elsewhere").mkdir()
    (tmp_path / "elsewhere" / "shown.yaml").write_text(shown.output)
    found, meant = load(tmp_path / "elsewhere" / "shown.yaml").architecture, load(file).architecture
    assert found.components.pop("left.eyes").host == "arm"
    meant.components.pop("left.eyes")
    assert (found.components, found.topics, found.modes) == (meant.components, meant.topics, meant.modes)
    assert found.hosts == ("local", "edge", "arm")


def test_what_is_shown_of_a_stack_with_modules_of_its_own_names_their_folders(
    regraft: Regraft, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    module = f"{tmp_path.name}_parts"
    with_module = ROBOT.replace("tests.stack.parts:Navigator", f"{module}:Own")
    file = rovers(tmp_path, robot=with_module)
    own = "from tests.stack.parts import Navigator\n\n\nclass Own(Navigator):\n    pass\n"
    (tmp_path / "rover" / f"{module}.py").write_text(own)
    shown = regraft("stack", "show", str(file)).output
    needed = shown.partition("\n")[0]
    assert needed.startswith("# ")
    assert needed.endswith(f": PYTHONPATH={tmp_path}/rover")
    (tmp_path / "elsewhere").mkdir()
    (tmp_path / "elsewhere" / "shown.yaml").write_text(shown)
    meant = load(file).architecture.components
    monkeypatch.setattr("sys.path", [path for path in sys.path if not path.startswith(str(tmp_path))])
    monkeypatch.delitem(sys.modules, module)
    with pytest.raises(StackError, match=f"No module named '{module}'"):
        load(tmp_path / "elsewhere" / "shown.yaml")
    monkeypatch.syspath_prepend(tmp_path / "rover")
    assert load(tmp_path / "elsewhere" / "shown.yaml").architecture.components == meant
    sys.modules.pop(module)


def test_what_is_shown_of_a_robot_has_its_data_in_what_modes_add_and_swap(regraft: Regraft, tmp_path: Path) -> None:
    pursuit = "class: 'regraft.services.navigator.pursuit_navigator:PursuitNavigator', parameters: {max_velocity: 0.4}"
    added = f"{{change: add, component: spare, spec: {{{pursuit}}}}}"
    swapped = "{change: swap, component: navigator, class: 'regraft.services.explorer.explorer:Explorer'}"
    modes = f"modes:\n  quick: [{added}]\n  still: [{swapped}]\n"
    file = rovers(tmp_path, f"{OF_ROVER}{modes}", DATA_OF_ROVER)
    shown = regraft("stack", "show", str(file))
    (tmp_path / "shown.yaml").write_text(shown.output)
    modes_shown = load(tmp_path / "shown.yaml").architecture.modes
    assert modes_shown["quick"][0]["spec"]["parameters"] == {
        **load(file).architecture.components["navigator"].parameters,
        "max_velocity": 0.4,
    }
    assert modes_shown["still"][0]["parameters"] == {"range_max": 8.0}


def test_each_value_is_shown_with_where_it_comes_from(regraft: Regraft, tmp_path: Path) -> None:
    file = rovers(tmp_path)
    (tmp_path / "params.yaml").write_text("left.navigator: {careful: true}\n")
    options = ("--params", str(tmp_path / "params.yaml"), "--set", "left.navigator.max_velocity=0.05")
    shown = regraft("stack", "show", str(file), *options).output.replace(f"{tmp_path}/", "")
    found = {" ".join(line.split()) for line in shown.splitlines()}
    assert "max_velocity: 0.05 # --set left.navigator.max_velocity=0.05" in found
    assert "careful: true # params.yaml:1" in found
    assert "max_velocity: 0.1 # stack.yaml:6" in found  # the other robot's, by its parameter
    assert "scan: left/scan # tests.stack.parts:Navigator" in found
    line = line_of(ROBOT, "class: tests.stack.parts:Navigator")
    assert f"class: tests.stack.parts:Navigator # rover/robot.yaml:{line}" in found
    told = json.loads(regraft("stack", "show", str(file), "--json").output)
    world = told["components"]["world"]["parameters"]
    assert world["robots"][1]["devices"][1]["parameters"]["beams"] == {"value": 30, "from": f"{file}:6"}
    assert world["robots"][0]["devices"][1]["parameters"]["beams"]["from"] == f"{tmp_path}/rover/robot.yaml:2"


def test_what_is_shown_of_a_value_of_several_lines_is_yaml(regraft: Regraft, tmp_path: Path) -> None:
    (file := tmp_path / "stack.yaml").write_text("system: a\ncomponents: {x: {command: [x], parameters: {text: b}}}\n")
    shown = regraft("stack", "show", str(file), "--set", "x.text='c\n\n  d'")
    (tmp_path / "shown.yaml").write_text(shown.output)
    assert load(tmp_path / "shown.yaml").architecture.components["x"].parameters == {"text": "c\nd"}


def test_a_parameter_called_speed_is_not_taken_for_the_speed_of_the_clock(regraft: Regraft, tmp_path: Path) -> None:
    file = rovers(tmp_path)
    odd = "  odd: {command: [x], managed: false, parameters: {speed: 0.3}}\n"
    file.write_text(f"{TWO}{odd}speed: max\n")
    lines = {text: f"{file}:{line_of(file.read_text(), text)}" for text in (odd, "speed: max")}

    def speeds(*options: str) -> list[object]:
        found = json.loads(regraft("stack", "show", str(file), "--json", *options).output)["components"]
        return [found[name]["parameters"]["speed"] for name in ("odd", "world")]

    assert speeds() == [{"value": 0.3, "from": lines[odd]}, {"value": "max", "from": lines["speed: max"]}]
    assert speeds("--set", "world.speed=real", "--set", "odd.speed=0.2") == [
        {"value": 0.2, "from": "--set odd.speed=0.2"},
        {"value": "real", "from": "--set world.speed=real"},
    ]


def test_a_graph_has_every_component_topic_and_connection(regraft: Regraft, tmp_path: Path) -> None:
    text = regraft("stack", "graph", str(rovers(tmp_path))).output
    assert text.startswith('digraph "two" {')
    assert 'label="left";' in text
    assert '"component left.eyes" -> "topic left/scan" [tooltip="scan"];' in text
    assert '"topic left/scan" -> "component left.navigator" [tooltip="scan"];' in text
    assert text.count("shape=box") == 5
    assert text.count("shape=ellipse") == 6
    out = tmp_path / "graph.dot"
    assert regraft("stack", "graph", str(tmp_path), "--out", str(out)).exit_code == 0
    assert out.read_text() == text


def test_a_picture_is_drawn_by_graphviz_or_says_what_to_install(
    regraft: Regraft, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file, out = str(rovers(tmp_path)), tmp_path / "graph.svg"
    monkeypatch.setenv("PATH", "/nowhere")
    done = regraft("stack", "graph", file, "--out", str(out))
    assert done.exit_code == 2
    assert "pictures need Graphviz's program 'dot': install the package graphviz, or write a .dot file" in done.stderr
    program = tmp_path / "bin" / "dot"
    program.parent.mkdir()
    program.write_text('#!/bin/sh\necho "<svg>$1"\n')
    program.chmod(0o755)
    monkeypatch.setenv("PATH", f"{program.parent}{os.pathsep}/usr/bin:/bin")
    assert regraft("stack", "graph", file, "--out", str(out)).exit_code == 0
    assert out.read_text() == "<svg>-Tsvg\n"


def test_a_picture_of_another_kind_is_refused(regraft: Regraft, tmp_path: Path) -> None:
    done = regraft("stack", "graph", str(rovers(tmp_path)), "--out", "graph.png")
    assert (done.exit_code, "must end in .dot or .svg" in done.stderr) == (2, True)
