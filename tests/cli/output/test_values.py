"""What is typed means what it would in a stack file."""

from __future__ import annotations

import json
import math
from contextlib import suppress
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from regraft.cli.bus.param import values_of
from regraft.cli.outcomes import BadInput
from regraft.cli.terminal.values import assignments, document, read_document, value_of


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("0.1", 0.1),
        ("3", 3),
        ("true", True),
        ("yes", "yes"),
        ("'3'", "3"),
        ("[1, 2.5]", [1, 2.5]),
        ("egl", "egl"),
        ("a: b", "a: b"),
        ("", None),
    ],
)
def test_a_value_is_read_as_in_a_stack_file(text: str, value: object) -> None:
    assert value_of(text, "value") == value


@pytest.mark.parametrize("text", ["[1", "'open", "{a: [}"])
def test_a_value_that_is_no_yaml_is_bad_input(text: str) -> None:
    with pytest.raises(BadInput, match="not YAML"):
        value_of(text, "value")


def test_an_assignment_is_split_at_the_first_equals_sign() -> None:
    assert assignments(["name=a=b"], "") == {"name": "a=b"}


@pytest.mark.parametrize("text", ["name", "=3", ""])
def test_an_assignment_without_name_or_value_is_bad_input(text: str) -> None:
    with pytest.raises(BadInput, match="name=value"):
        assignments([text], "")


def test_one_parameter_may_be_given_as_ros_users_give_it() -> None:
    assert values_of(["speed", "0.1"]) == values_of(["speed=0.1"]) == {"speed": 0.1}


def test_several_parameters_may_be_given_at_once() -> None:
    assert values_of(["a=1", "b=x"]) == {"a": 1, "b": "x"}


def test_a_parameter_given_twice_is_bad_input() -> None:
    with pytest.raises(BadInput, match="twice"):
        values_of(["a=1", "a=2"])


@pytest.mark.parametrize("typed", [["speed", "1e400"], ["speed=1e400"], ["speed=[1e400]"]])
def test_an_infinite_number_is_refused_by_its_component_and_parameter(typed: list[str]) -> None:
    with pytest.raises(BadInput, match=r"^wheels\.speed(:1)?: .*1e400 is too large for a number"):
        values_of(typed, "wheels.")


numbers = st.integers(-(2**53), 2**53) | st.floats(allow_nan=False, allow_infinity=False)
names = st.text(st.characters(codec="ascii", categories=("Ll", "Lu")), min_size=1, max_size=8)
bodies = st.recursive(
    st.none() | st.booleans() | numbers | st.text(st.characters(codec="ascii", exclude_categories=["Cc"])),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(names, inner, max_size=4),
    max_leaves=12,
)


@given(bodies)
def test_a_body_in_json_means_what_json_says(body: Any) -> None:
    assert same(document(json.dumps(body), "body"), body)


def same(one: Any, other: Any) -> bool:
    """Compare, taking 1.0 and 1 for the same."""
    if isinstance(one, float) or isinstance(other, float):
        return math.isclose(one, other)
    if isinstance(one, dict):
        return one.keys() == other.keys() and all(same(one[name], other[name]) for name in one)
    if isinstance(one, list):
        return len(one) == len(other) and all(map(same, one, other))
    return bool(one == other)


@given(st.text(max_size=60))
def test_whatever_is_typed_is_read_or_is_bad_input(text: str) -> None:
    with suppress(BadInput):
        value_of(text, "value")


def test_a_file_that_cannot_be_read_is_bad_input(tmp_path: Path) -> None:
    with pytest.raises(BadInput, match="No such file"):
        read_document(str(tmp_path / "none.yaml"))
    (tmp_path / "latin").write_bytes(b"\xff")
    with pytest.raises(BadInput, match="UTF-8"):
        read_document(str(tmp_path / "latin"))


@pytest.mark.parametrize("file", ["/dev/zero", "-"])
def test_a_document_without_end_is_not_read_to_its_end(monkeypatch: pytest.MonkeyPatch, file: str) -> None:
    with Path("/dev/zero").open(encoding="latin-1") as endless:
        monkeypatch.setattr("sys.stdin", endless)
        with pytest.raises(BadInput, match="is more than 1024 KiB"):
            read_document(file)
