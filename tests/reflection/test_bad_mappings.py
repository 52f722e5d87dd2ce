"""A mapping that cannot be is refused with line and field before anything runs, and so is one by override."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from regraft.stack import Problem, Stack, StackError, apply_overrides, load
from tests.stack.reading.files import line_of, problems, write

GOOD = """\
system: tests
topics:
  odometry: {type: regraft/Odometry, rate: 20}
  battery: {type: regraft/BatteryState, rate: 2}
  light: {type: regraft/LightLevel, rate: 2}
  reflection: regraft/ReflectedEntries
components:
  wheels: {class: "tests.reflection.parts:Wheels"}
  battery: {class: "tests.reflection.parts:Battery"}
  system_reflection:
    class: regraft.services.system_reflection:SystemReflection
    parameters:
      mapping:
        - {topic: odometry, field: twist.linear.x, entry: speed, rate: 10, reduce: abs}
        - topic: battery
          field: charge
          entry: battery_charge
          rate: 2
    connect: {reflection: reflection}
"""
MAPPING = "components.system_reflection.parameters.mapping"
SPEED = "{topic: odometry, field: twist.linear.x, entry: speed, rate: 10, reduce: abs}"

CASES = [
    (
        ("topic: odometry", "topic: odometri"),
        "odometri",
        f"{MAPPING}.0",
        "input 'speed' is connected to 'odometri', which is not in the topic table; did you mean 'odometry'?",
    ),
    (
        ("twist.linear.x", "twist.linar.x"),
        "linar",
        f"{MAPPING}.0",
        "input 'speed' cannot read topic 'odometry': Odometry.twist has no field 'linar'; it has: linear, angular",
    ),
    (
        ("field: charge", "field: darkness"),
        "- topic: battery",
        f"{MAPPING}.1",
        "input 'battery_charge' cannot read topic 'battery': BatteryState has no field 'darkness'; it has: stamp, ",
    ),
    (
        ("reduce: abs", "reduce: norm"),
        "reduce: norm",
        f"{MAPPING}.0",
        "input 'speed' cannot read topic 'odometry': Odometry.twist.linear.x is a number, must be a record, list or ",
    ),
    (
        ("entry: battery_charge", "entry: speed"),
        "- topic: battery",
        f"{MAPPING}.1",
        "mapping.0 asks for a port 'speed' already: each needs a name of its own",
    ),
    (
        ("entry: battery_charge", "entry: reflection"),
        "- topic: battery",
        f"{MAPPING}.1",
        "the class has a port 'reflection' already: each needs a name of its own",
    ),
    (("rate: 2\n    connect", "rate: 0\n    connect"), "rate: 0\n", f"{MAPPING}.1.rate", "is 0.0, must be at least 0"),
    (("rate: 2\n    connect", "rate: x\n    connect"), "rate: x\n", f"{MAPPING}.1.rate", "is str, must be a number"),
    (("          rate: 2\n", ""), "- topic: battery", f"{MAPPING}.1.rate", "is missing"),
    (("field: charge", "field: 3"), "field: 3", f"{MAPPING}.1.field", "is int, must be text"),
    (
        ("reduce: abs", "reduce: half"),
        "half",
        f"{MAPPING}.0.reduce",
        "is 'half', must be one of: abs, norm, min, max, mean, length, text",
    ),
    (("reduce: abs", "at_least: 1"), "at_least", f"{MAPPING}.0.at_least", "is for reduce: min, max and mean"),
    (("reduce: abs", "stale_after: -1"), "stale", f"{MAPPING}.0.stale_after", "is -1.0, must be at least 0.0"),
    (
        ("reduce: abs", "reduc: abs"),
        "reduc:",
        f"{MAPPING}.0",
        "has no field 'reduc'; did you mean 'reduce'? Mapped has: at_least, entry, ",
    ),
    (
        ("entry: battery_charge", "entry: my speed"),
        "my speed",
        f"{MAPPING}.1.entry",
        "'my speed' must be a letter, then letters, digits and '_'",
    ),
    (
        ("entry: battery_charge", "entry: speed_age"),
        "speed_age",
        f"{MAPPING}.1.entry",
        "'speed_age' must not end in '_age' or '_stale'",
    ),
    (("- " + SPEED, "odometry: speed"), "      mapping", MAPPING, "{'odometry': 'speed'}: must be an array"),
    (("- " + SPEED, "- speed"), "      mapping", MAPPING, "['speed', {'topic': "),
    (
        ("connect: {reflection: reflection}", "connect: {speed: battery}"),
        "connect:",
        "components.system_reflection.connect.speed",
        "input 'speed' cannot read topic 'battery': BatteryState has no field 'twist'",
    ),
]


def loaded(folder: Path, text: str = GOOD) -> Stack:
    """Return the stack that a text is."""
    return load(write(folder, text))


@pytest.mark.parametrize(("change", "where", "field", "problem"), CASES, ids=[case[0][1] for case in CASES])
def test_a_bad_mapping_is_refused_with_line_and_field(
    tmp_path: Path, change: tuple[str, str], where: str, field: str, problem: str
) -> None:
    text = GOOD.replace(*change)
    if change[1] == "odometry: speed":
        text = GOOD[: GOOD.index("        - {")] + "        odometry: speed\n"
    assert text != GOOD
    (found,) = problems(tmp_path, text)
    assert (found.field, found.line) == (field, line_of(text, where))
    assert found.problem.startswith(problem)


def test_everything_wrong_with_a_mapping_is_told_at_once(tmp_path: Path) -> None:
    text = GOOD.replace("rate: 10", "rate: 0").replace("rate: 2\n    connect", "rate: -2\n    connect")
    assert [found.field for found in problems(tmp_path, text)] == [f"{MAPPING}.0.rate", f"{MAPPING}.1.rate"]
    text = GOOD.replace("twist.linear.x", "x").replace("field: charge", "field: y")
    assert [found.field for found in problems(tmp_path, text)] == [f"{MAPPING}.0", f"{MAPPING}.1"]


def test_every_entry_is_connected_to_its_topic_and_needs_no_writer(tmp_path: Path) -> None:
    text = GOOD.replace("topic: battery\n", "topic: light\n").replace("field: charge", "field: darkness")
    spec = loaded(tmp_path, text).architecture.components["system_reflection"]
    assert spec.connections == {"reflection": "reflection", "speed": "odometry", "battery_charge": "light"}


def overridden(stack: Stack, *values: str) -> Stack:
    """Return the stack with another mapping."""
    return apply_overrides(stack, [f"system_reflection.mapping=[{', '.join(values)}]"])


def test_an_override_gives_the_ports_that_it_asks_for(tmp_path: Path) -> None:
    stack = overridden(loaded(tmp_path), "{topic: light, field: darkness, entry: dark, rate: 1}")
    spec = stack.architecture.components["system_reflection"]
    assert spec.connections == {"reflection": "reflection", "dark": "light"}
    assert spec.description is not None
    assert [port.name for port in spec.description.ports] == ["dark", "reflection"]


def test_an_override_keeps_what_the_file_connects(tmp_path: Path) -> None:
    text = GOOD.replace("odometry: {", "other: regraft/Odometry\n  odometry: {")
    text = text.replace("connect: {reflection: reflection}", "connect: {speed: other}")
    stack = overridden(loaded(tmp_path, text), SPEED.replace("rate: 10", "rate: 5"))
    connections = stack.architecture.components["system_reflection"].connections
    assert connections == {"reflection": "reflection", "speed": "other"}


def test_a_bad_override_is_told_as_such(tmp_path: Path) -> None:
    for value, field in (
        (SPEED.replace("10", "0"), f"{MAPPING}.0.rate"),
        (SPEED.replace("twist", "x"), f"{MAPPING}.0"),
    ):
        with pytest.raises(StackError) as refused:
            overridden(loaded(tmp_path), value)
        (found,) = refused.value.problems
        assert isinstance(found, Problem)
        assert (found.field, found.line) == (field, None)
        assert found.file.startswith("--set system_reflection.mapping=[")


LINES = st.fixed_dictionaries(
    {},
    optional={
        "topic": st.sampled_from(["odometry", "battery", "light", "nowhere", "", 3]),
        "field": st.sampled_from(["twist.linear.x", "charge", "stamp", "twist", "", "..", "0", None]),
        "entry": st.sampled_from(["speed", "charge", "x_age", "reflection", "", "a b", 7]),
        "rate": st.sampled_from([10, 0.5, 0, -1, "fast", 1e9, True]),
        "reduce": st.sampled_from([None, "abs", "norm", "min", "length", "text", "most"]),
        "at_least": st.sampled_from([None, 0, "x"]),
        "stale_after": st.sampled_from([None, 1, -1]),
        "colour": st.just("red"),
    },
)


@settings(max_examples=150, deadline=None)
@given(st.lists(LINES, max_size=3))
def test_whatever_stands_in_a_mapping_is_loaded_or_refused_with_its_line(
    tmp_path_factory: pytest.TempPathFactory, mapping: list[dict[str, Any]]
) -> None:
    head = GOOD[: GOOD.index("      mapping:")]
    text = head + f"      mapping: {json.dumps(mapping)}\n"
    folder = tmp_path_factory.mktemp("stack")
    try:
        stack = loaded(folder, text)
    except StackError as refused:
        assert all(found.line == line_of(text, "      mapping") for found in refused.problems)
        assert all(found.field.startswith(MAPPING) for found in refused.problems)
    else:
        spec = stack.architecture.components["system_reflection"]
        assert list(spec.connections) == [*(line["entry"] for line in mapping), "reflection"]
