"""Overrides change a stack as if its file said so, and are refused by name where they cannot."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from regraft.stack import Stack, StackError, apply_overrides, load, with_seed, with_speed, with_system
from tests.stack.reading.files import GOOD, good, write


def refused(change: Callable[[], Stack]) -> list[str]:
    """Return the problems of a change that must be refused."""
    with pytest.raises(StackError) as caught:
        change()
    return [str(problem) for problem in caught.value.problems]


def test_override_sets_a_parameter(tmp_path: Path) -> None:
    stack = apply_overrides(good(tmp_path), ["rescuer.navigator.max_velocity=0.1", "world.tick_rate=10"])
    assert stack.architecture.components["rescuer.navigator"].parameters["max_velocity"] == 0.1
    assert stack.architecture.components["world"].parameters["tick_rate"] == 10


def test_the_last_override_of_a_parameter_holds(tmp_path: Path) -> None:
    stack = apply_overrides(good(tmp_path), ["world.tick_rate=10", "world.tick_rate=30"])
    assert stack.architecture.components["world"].parameters["tick_rate"] == 30


@pytest.mark.parametrize(
    ("text", "value"), [("gains=[3, 4]", [3, 4]), ("careful=true", True), ("planner='straight'", "straight")]
)
def test_values_are_yaml(tmp_path: Path, text: str, value: object) -> None:
    stack = apply_overrides(good(tmp_path), [f"rescuer.navigator.{text}"])
    name = text.partition("=")[0]
    assert stack.architecture.components["rescuer.navigator"].parameters[name] == value


def test_overriding_path_is_looked_for_in_the_current_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    stack = good(tmp_path)
    (tmp_path / "elsewhere").mkdir()
    monkeypatch.chdir(tmp_path / "elsewhere")
    world = apply_overrides(stack, ["world.file=moon.xml"]).architecture.components["world"]
    assert world.parameters["file"] == str(tmp_path / "elsewhere" / "moon.xml")


@pytest.mark.parametrize(
    ("override", "problem"),
    [
        ("max_velocity=1", "must look like 'component.parameter=value'"),
        ("rescuer.navigator.max_velocity", "must look like 'component.parameter=value'"),
        ("wrld.tick_rate=1", "there is no component 'wrld'; did you mean 'world'?"),
        (
            "world.tick_rat=1",
            "components.world.parameters.tick_rat: there is no such parameter; did you mean",
        ),
        ("world.tick_rate=0", "components.world.parameters.tick_rate: 0: must be at least 1.0 Hz"),
        ("world.tick_rate=", "components.world.parameters.tick_rate: null: must be a number"),
        ("rescuer.navigator.gains=[1", "is not YAML"),
    ],
)
def test_bad_override_is_refused_by_name(tmp_path: Path, override: str, problem: str) -> None:
    (text,) = refused(lambda: apply_overrides(good(tmp_path), [override]))
    assert text.startswith(f"--set {override}:")
    assert problem in text


def test_every_bad_override_is_told(tmp_path: Path) -> None:
    texts = refused(lambda: apply_overrides(good(tmp_path), ["nobody.a=1", "world.tick_rate=x", "b"]))
    assert len(texts) == 3


def test_override_against_a_constraint_is_refused(tmp_path: Path) -> None:
    text = (
        "system: a\ncomponents:\n  n: {class: 'tests.stack.parts:Joystick'}\n  r:\n    command: [r]\n"
        "    parameters: {depth: 3}\ntopics: {velocity: regraft/Twist}\n"
        "constraints:\n  - {parameter: r.depth, at_least: 2, because: shallow is useless}\n"
    )
    (problem,) = refused(lambda: apply_overrides(load(write(tmp_path, text)), ["r.depth=1"]))
    assert problem.startswith("--set r.depth=1: components.r.parameters.depth: 1: a constraint says")
    assert problem.endswith("must be at least 2.0, because shallow is useless")


def test_seed_speed_and_system_can_be_changed(tmp_path: Path) -> None:
    stack = with_system(with_speed(with_seed(good(tmp_path), 9), "real"), "toad")
    assert (stack.seed, stack.speed, stack.name) == (9, "real", "toad")


def test_bad_seed_speed_and_system_are_refused(tmp_path: Path) -> None:
    stack = good(tmp_path)
    assert refused(lambda: with_seed(stack, -1))[0].startswith("seed: -1: must be from 0")
    assert "must be one of: real, max" in refused(lambda: with_speed(stack, "double"))[0]
    assert refused(lambda: with_system(stack, "a/b"))[0].startswith("system: 'a/b' cannot name a system")


def test_real_time_has_no_speed_to_change(tmp_path: Path) -> None:
    stack = load(
        write(tmp_path, "system: a\ncomponents:\n  g: {class: 'tests.stack.parts:Presser', state: unconfigured}\n")
    )
    assert stack.speed is None
    assert "runs under the real clock" in refused(lambda: with_speed(stack, "max"))[0]


def test_a_program_without_parameters_takes_none(tmp_path: Path) -> None:
    notes = "  notes: {command: [notes], managed: false}\n"
    stack = load(write(tmp_path, GOOD.replace("constraints:\n", f"{notes}constraints:\n")))
    (problem,) = refused(lambda: apply_overrides(stack, ["notes.foo=3"]))
    assert problem.startswith("--set notes.foo=3: components.notes.parameters.foo: there is no such parameter")
