"""Files that parameters name and that have to be there are missed before anything starts."""

from __future__ import annotations

from pathlib import Path

import pytest

from regraft.stack import Problem, Stack, StackError, apply_overrides, load, load_as_asked
from tests.stack.reading.files import changed, good, line_of, problems, write

ELSEWHERE = """\
system: tests
clock: real
hosts: [edge]
topics: {velocity: regraft/Twist}
components:
  joystick:
    class: tests.stack.parts:Joystick
    host: HOST
    parameters: {layout: buttons.yaml}
"""
PARAMETERS = "file: world.xml, tick_rate: 10"


def naming(mesh: str) -> str:
    """Return the good stack's text, the world with a mesh."""
    return changed((PARAMETERS, f"{PARAMETERS}, mesh: {mesh}"))


def in_mode(mesh: str) -> str:
    """Return the good stack's text with a mode that sets the world's mesh."""
    change = f"{{change: set_parameters, component: world, parameters: {{mesh: {mesh}}}}}"
    return changed() + f"modes:\n  full: [{change}]\n"


@pytest.fixture
def with_cube(tmp_path: Path) -> Path:
    """Return a folder with a file."""
    (tmp_path / "meshes").mkdir()
    (tmp_path / "meshes/cube.stl").write_text("")
    return tmp_path


def mesh_of(stack: Stack) -> object:
    """Return the world's mesh."""
    return stack.architecture.components["world"].parameters["mesh"]


@pytest.mark.parametrize("mesh", ["meshes/cube.stl", "./meshes/../meshes/cube.stl", "''", "$RUN/cube.stl"])
def test_a_file_that_is_there_is_taken(mesh: str, with_cube: Path) -> None:
    load(write(with_cube, naming(mesh)))


def test_a_missing_file_is_told_with_its_place_and_the_nearest_one(with_cube: Path) -> None:
    (problem,) = problems(with_cube, naming("meshes/cub.stl"))
    assert problem == Problem(
        str(with_cube / "stack.yaml"),
        line_of(naming("x"), "mesh:"),
        "components.world.parameters.mesh",
        f"'{with_cube}/meshes/cub.stl': there is no such file; did you mean '{with_cube}/meshes/cube.stl'?",
    )


def test_a_folder_is_no_file(with_cube: Path) -> None:
    (problem,) = problems(with_cube, naming("meshes"))
    assert problem.problem == f"'{with_cube}/meshes': is not an ordinary file"


@pytest.mark.parametrize("mesh", ["'a\\0b'", "x" * 5000, "'\\ud800'"])
def test_a_name_that_no_file_can_have_is_refused(mesh: str, tmp_path: Path) -> None:
    assert problems(tmp_path, naming(mesh.replace("'", '"')))


def test_an_override_that_names_a_missing_file_is_named(tmp_path: Path) -> None:
    with pytest.raises(StackError) as refused:
        apply_overrides(good(tmp_path), [f"world.mesh={tmp_path}/cube.stl"])
    assert str(refused.value).startswith(f"--set world.mesh={tmp_path}/cube.stl: components.world.parameters.mesh: ")


def test_a_mode_finds_its_files_from_the_stacks_folder(with_cube: Path) -> None:
    (change,) = load(write(with_cube, in_mode("meshes/cube.stl"))).architecture.modes["full"]
    assert change["parameters"] == {"mesh": str(with_cube / "meshes/cube.stl")}
    (problem,) = problems(with_cube, in_mode("meshes/cub.stl"))
    assert problem.line == line_of(in_mode("x"), "full:")
    assert problem.field == "modes.full.0.parameters.mesh"
    assert "cube.stl'?" in problem.problem


def test_what_is_only_written_need_not_be_there(tmp_path: Path) -> None:
    assert good(tmp_path).architecture.components["world"].parameters["file"] == str(tmp_path / "world.xml")


def test_another_host_has_files_of_its_own(tmp_path: Path) -> None:
    load(write(tmp_path, ELSEWHERE.replace("HOST", "edge")))
    assert problems(tmp_path, ELSEWHERE.replace("HOST", "local"))


def test_an_option_may_place_a_component_where_its_file_is_or_name_another_file(with_cube: Path) -> None:
    file = write(with_cube, ELSEWHERE.replace("HOST", "local"))
    (with_cube / "given.yaml").write_text("joystick: {layout: meshes/cube.stl}\n")
    assert load_as_asked(file, places=["joystick=edge"]).architecture.components["joystick"].host == "edge"
    named = load_as_asked(file, overrides=[f"joystick.layout={with_cube}/meshes/cube.stl"])
    assert named.architecture == load_as_asked(file, [with_cube / "given.yaml"]).architecture
    load_as_asked(file, overrides=["joystick.layout=''"])
    with pytest.raises(StackError, match="there is no such file"):
        load_as_asked(file)


def test_a_missing_file_is_named_beside_all_else_that_is_wrong(tmp_path: Path) -> None:
    file = write(tmp_path, ELSEWHERE.replace("HOST", "local"))
    for overrides in ([], ["joystick.layuot=1"], ["joystick.layout=b.yaml"]):
        with pytest.raises(StackError) as refused:
            load_as_asked(file, overrides=overrides)
        assert any("there is no such file" in problem.problem for problem in refused.value.problems)
    file.write_text(file.read_text().replace("clock: real", "clock: reel"))
    with pytest.raises(StackError) as refused:
        load_as_asked(file, places=["joystick=edge"])
    assert len(refused.value.problems) == 2
