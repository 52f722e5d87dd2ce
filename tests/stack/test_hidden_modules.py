"""A module of an author's that another one of its name hides is told, with what to do."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from regraft.process.main import NoSuchClass, load_class
from regraft.stack import load
from regraft.stack.classes import look_in
from tests.stack.reading.files import problems
from tests.stack.reading.folders import rovers, told

COMPONENT = "from regraft import Component\n\n\nclass Siren(Component):\n    'Howls.'\n"
STACK = "system: tests\nimports: [{imported}]\ncomponents:\n  siren: {{class: '{path}'}}\n"
ROBOTS = """\
system: two
clock: simulated
world: room.xml
robots: {l: {robot: left}, q: {robot: right}}
components:
  world: {class: "tests.stack.parts:Fleet", parameters: {file: $world, robots: $robots}}
"""
COMPONENTS = """\
model: ../rover/rover.xml
components: {{siren: {{class: "{0}:Siren"}}}}
"""
DEVICES = """\
model: ../rover/rover.xml
devices: {{siren: {{class: "{0}:Siren"}}}}
"""


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return a stack's folder, which modules are looked for in last."""
    monkeypatch.setattr(sys, "path", [*sys.path])
    look_in(tmp_path)
    return tmp_path


@pytest.mark.parametrize("name", ["types", "queue", "statistics"])
@pytest.mark.parametrize("called", ["Siren", "Queue"])
def test_a_class_in_a_file_that_the_standard_library_hides(folder: Path, name: str, called: str) -> None:
    file = folder / f"{name}.py"
    file.write_text(COMPONENT)
    (problem,) = problems(folder, STACK.format(imported="regraft.bus_schema", path=f"{name}:{called}"))
    assert (problem.line, problem.field) == (4, "components.siren.class")
    assert problem.problem.endswith(f"the module {name!r} of the standard library hides {file}: rename that")
    assert "did you mean" not in problem.problem


def test_a_hidden_file_is_found_behind_a_folder_that_cannot_be_read(folder: Path) -> None:
    sys.path.insert(0, str(folder / ("x" * 300)))
    (folder / "types.py").write_text(COMPONENT)
    with pytest.raises(NoSuchClass, match=f"of the standard library hides {folder}/types.py: rename that"):
        load_class("types:Siren")


def test_a_module_in_a_package_that_the_standard_library_hides(folder: Path) -> None:
    (folder / "types").mkdir()
    file = folder / "types" / "sirens.py"
    file.write_text(COMPONENT)
    with pytest.raises(NoSuchClass, match=f"of the standard library hides {file}: rename that"):
        load_class("types.sirens:Siren")


def test_an_import_of_a_file_that_the_standard_library_hides(folder: Path) -> None:
    (folder / "queue.py").write_text(COMPONENT)
    (problem,) = problems(folder, STACK.format(imported="queue", path="regraft.services.lighting:Lighting"))[:1]
    assert (problem.line, problem.field) == (2, "imports.0")
    assert problem.problem == f"the module 'queue' of the standard library hides {folder}/queue.py: rename that"


@pytest.mark.parametrize("line", ["from types import SIREN", "import types\ntypes.SIREN"])
def test_what_an_authors_module_takes_from_a_hidden_one(folder: Path, line: str) -> None:
    (folder / "types.py").write_text("SIREN = 1\n")
    name = f"hidden_user_{len(line)}"
    (folder / f"{name}.py").write_text(f"{line}\n{COMPONENT}")
    with pytest.raises(NoSuchClass, match=f"'types' of the standard library hides {folder}/types.py: rename that"):
        load_class(f"{name}:Siren")


def test_a_file_that_one_of_our_packages_hides(folder: Path) -> None:
    (folder / "regraft.py").write_text(COMPONENT)
    with pytest.raises(NoSuchClass, match=f"the module 'regraft' hides {folder}/regraft.py: rename that"):
        load_class("regraft:Siren")


@pytest.mark.parametrize("name", ["services", "evaluation", "stacks", "bus_schema"])
def test_authors_may_call_their_modules_as_we_call_our_rooms(folder: Path, name: str) -> None:
    (folder / f"{name}.py").write_text(COMPONENT)
    assert load_class(f"{name}:Siren").__module__ == name
    del sys.modules[name]


def test_where_nothing_is_hidden_nothing_is_said_of_it(folder: Path) -> None:
    with pytest.raises(NoSuchClass) as refused:
        load_class("types:Siren")
    assert "hides" not in str(refused.value)


@pytest.mark.parametrize("component", [True, False])
def test_a_robots_module_that_another_robots_hides(tmp_path: Path, *, component: bool) -> None:
    name = f"turner_of_{'component' if component else 'device'}"
    for robot in ("left", "right"):
        (tmp_path / robot).mkdir()
        (tmp_path / robot / f"{name}.py").write_text(COMPONENT.replace("Howls.", robot))
    robot = COMPONENTS if component else DEVICES
    path = rovers(tmp_path, ROBOTS, left_robot=robot.format(name), right_robot=robot.format(name))
    (line,) = told(path)
    assert line.startswith("right/robot.yaml:2: components.")
    assert line.endswith(f"the module {name!r} hides right/{name}.py: rename that")


def test_a_robots_module_in_a_folder_that_another_robot_has_too(tmp_path: Path) -> None:
    for robot in ("left", "right"):
        (tmp_path / robot / "robot_parts").mkdir(parents=True)
        (tmp_path / robot / "robot_parts" / "turner.py").write_text(COMPONENT.replace("Howls.", robot))
    (tmp_path / "right" / "robot_parts" / "own.py").write_text(COMPONENT)
    shared, own = COMPONENTS.format("robot_parts.turner"), COMPONENTS.format("robot_parts.own")
    (line,) = told(rovers(tmp_path, ROBOTS, left_robot=shared, right_robot=shared))
    assert line.endswith("the module 'robot_parts' hides right/robot_parts/turner.py: rename that")
    load(rovers(tmp_path, ROBOTS, left_robot=shared, right_robot=own))


def test_two_robots_of_one_folder_share_its_module(tmp_path: Path) -> None:
    (tmp_path / "left").mkdir()
    (tmp_path / "left" / "turner_of_both.py").write_text(COMPONENT)
    stack = ROBOTS.replace("right}", "left}")
    path = rovers(tmp_path, stack, left_robot=COMPONENTS.format("turner_of_both"))
    assert {"l.siren", "q.siren"} <= set(load(path).architecture.components)
