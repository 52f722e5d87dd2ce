"""Files of parameters change a stack as if its file said so."""

from __future__ import annotations

from pathlib import Path

import pytest

from regraft.stack import StackError, apply_overrides, apply_parameter_files
from tests.stack.reading.files import good


def write(folder: Path, text: str, name: str = "params.yaml") -> Path:
    file = folder / name
    file.write_text(text)
    return file


def test_a_later_file_goes_over_an_earlier_one_and_an_override_over_both(tmp_path: Path) -> None:
    one = write(tmp_path, "rescuer.navigator: {max_velocity: 0.1, gains: [1, 2]}\nworld: {tick_rate: 20}\n")
    two = write(tmp_path, "rescuer.navigator:\n  max_velocity: 0.15\n", "two.yaml")
    stack = apply_overrides(apply_parameter_files(good(tmp_path), [one, two]), ["world.tick_rate=30"])
    components = stack.architecture.components
    assert components["rescuer.navigator"].parameters == {"max_velocity": 0.15, "gains": [1, 2]}
    assert components["world"].parameters["tick_rate"] == 30
    places = {
        name: str(stack.locations[f"components.{name}"])
        for name in (
            "rescuer.navigator.parameters.gains.1",
            "rescuer.navigator.parameters.max_velocity",
            "world.parameters.tick_rate",
        )
    }
    assert list(places.values()) == [f"{one}:1", f"{two}:2", "--set world.tick_rate=30"]


def test_a_relative_path_is_looked_for_beside_the_file(tmp_path: Path) -> None:
    (tmp_path / "inside").mkdir()
    file = write(tmp_path, "world: {file: moon.xml}\n", "inside/params.yaml")
    world = apply_parameter_files(good(tmp_path), [file]).architecture.components["world"]
    assert world.parameters["file"] == str(tmp_path / "inside" / "moon.xml")


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ("\nwrld: {tick_rate: 1}\n", "params.yaml:2: wrld: there is no component 'wrld'; did you mean 'world'?"),
        ("world: 3\n", "params.yaml:1: world: must be a map of parameters, is a number"),
        (
            "world:\n  tick_rat: 1\n",
            "params.yaml:2: components.world.parameters.tick_rat: there is no such parameter; did",
        ),
        (
            "world:\n  tick_rate: 0\n",
            "params.yaml:2: components.world.parameters.tick_rate: 0: must be at least 1.0 Hz",
        ),
        ("- a\n", "params.yaml:1: must be a map of component names, is a list"),
        ("world: [\n", "params.yaml:2: is not YAML: "),
    ],
)
def test_a_wrong_file_is_refused_with_its_line(tmp_path: Path, text: str, problem: str) -> None:
    stack = good(tmp_path)
    with pytest.raises(StackError) as caught:
        apply_parameter_files(stack, [write(tmp_path, text)])
    assert str(caught.value).replace(f"{tmp_path}/", "").startswith(problem)


def test_a_missing_file_is_refused(tmp_path: Path) -> None:
    with pytest.raises(StackError, match=r"no\.yaml: there is no such file"):
        apply_parameter_files(good(tmp_path), [tmp_path / "no.yaml"])
