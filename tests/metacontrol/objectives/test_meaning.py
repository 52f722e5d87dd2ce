"""The meaning of bounds, and of metacontrollers' names."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from regraft.bus_schema.encoding import codec
from regraft.bus_schema.errors import BadMessage
from regraft.bus_schema.messages.management.objectives import Objective
from regraft.bus_schema.model.qualities.bounds import Bound, Comparison, read_bound, read_bounds
from regraft.bus_schema.model.robots.metacontrollers import (
    NoMetacontroller,
    NoSuchMetacontroller,
    WhichMetacontroller,
    metacontroller,
)

QUALITIES = st.from_regex(r"[A-Za-z_][A-Za-z0-9_]{0,20}", fullmatch=True)


@given(QUALITIES, st.sampled_from([">=", "<=", "=", ":"]), st.floats(allow_nan=False, allow_infinity=False))
def test_a_bound_is_read_with_or_without_spaces(quality: str, sign: str, number: float) -> None:
    comparison = None if sign in "=:" else Comparison(sign)
    for text in (f"{quality}{sign}{number!r}", f" {quality} {sign} {number!r} "):
        assert read_bound(text) == Bound(quality, number, comparison)


@given(st.text(max_size=400))
def test_no_text_is_read_as_anything_but_a_bound(text: str) -> None:
    try:
        bound = read_bound(text)
    except ValueError as error:
        assert str(error)
    else:
        assert bound.quality in text


@pytest.mark.parametrize(
    ("texts", "reason"),
    [
        (["safety>0.5"], "safety: '>' compares no bound: must be >=, <= or ="),
        (["safety==0.5"], "'=='"),
        (["safety=nan"], "safety: nan is not finite"),
        (["=0.5"], "must look like"),
        (["safety=1 or 2"], "must look like"),
        (["a=1", "a>=2"], "a: has two numbers"),
        (["a" * 400], "has 400 characters, must have at most 300"),
    ],
)
def test_a_text_that_is_no_bound_is_refused_with_the_form(texts: list[str], reason: str) -> None:
    with pytest.raises(ValueError, match=r"must|finite|two") as refused:
        read_bounds(texts)
    assert reason in str(refused.value)


def test_a_comparison_travels_as_its_sign() -> None:
    objective = Objective("to_navigate", requirements={"safety": 0.5}, operators={"safety": Comparison.AT_LEAST})
    plain = codec.to_plain(objective)
    assert plain["operators"] == {"safety": ">="}
    assert codec.from_plain(plain, Objective) == objective
    with pytest.raises(BadMessage):
        codec.from_plain({**plain, "operators": {"safety": ">"}}, Objective)


@pytest.mark.parametrize(
    ("known", "name", "meant"),
    [
        (["metacontrol"], "", "metacontrol"),
        (["a", "b"], "b", "b"),
        (["left.metacontrol"], "metacontrol", "left.metacontrol"),
        (["left.metacontrol", "right.metacontrol"], "right.metacontrol", "right.metacontrol"),
        (["metacontrol", "left.metacontrol"], "metacontrol", "metacontrol"),
    ],
)
def test_a_metacontroller_is_meant_by_its_name_or_as_the_only_one(known: list[str], name: str, meant: str) -> None:
    assert metacontroller(known, name) == meant


@pytest.mark.parametrize(
    ("known", "name", "error", "reason"),
    [
        ([], "", NoMetacontroller, "add a component to its stack"),
        ([], "metacontrol", NoMetacontroller, "add a component to its stack"),
        (["metacontrol"], "metacontrl", NoSuchMetacontroller, "did you mean 'metacontrol'?"),
        (["a", "b"], "", WhichMetacontroller, "several metacontrollers: a, b: name one of them"),
        (["x.m", "y.m"], "m", WhichMetacontroller, "several metacontrollers: x.m, y.m: name one of them"),
    ],
)
def test_a_metacontroller_that_is_not_clear_is_refused_with_the_names(
    known: list[str], name: str, error: type[Exception], reason: str
) -> None:
    with pytest.raises(error, match="metacontroller") as refused:
        metacontroller(known, name)
    assert reason in str(refused.value)
