"""Expressions are worth what they are in Python, of a few parts, and do no harm."""

from __future__ import annotations

from contextlib import suppress

import pytest
from hypothesis import given
from hypothesis import strategies as st

from regraft.bus_schema.errors import BadMessage
from regraft.bus_schema.model.expressions import Expression, NotComputable, Unknown

VALUES: dict[str, object] = {"a": 2.0, "b.c": 3, "r.c.z": "fast", "d.active": True, "e": 0.0, "some": ("x", "y")}


@pytest.mark.parametrize(
    ("text", "worth"),
    [
        ("a * 2 <= b.c + 1", True),
        ("a < b.c < 3", False),
        ("1 < a <= 2 < b.c", True),
        ("r.c.z == 'fast' and not d.active", False),
        ("-a == -2 or 1 / 0 > 1", True),
        ("(a + 1) / b.c", 1.0),
        ("a != 2.0", False),
        ("some == some", True),
        ("r.c.z + 'er'", "faster"),
        ("a if e else 'none'", "none"),
    ],
)
def test_an_expression_is_worth_what_it_is_in_python(text: str, worth: object) -> None:
    assert Expression(text).value(VALUES) == worth


@pytest.mark.parametrize(
    ("text", "number"),
    [
        ("a + b.c * 2 - 1", 7.0),
        ("-a / 4", -0.5),
        ("1.0 if r.c.z == 'fast' and not e else 0.0", 1.0),
        ("d.active", 1.0),
        ("max(a, b.c) + min(a, b.c) + abs(-1)", 6.0),
        ("hypot(a + 2, b.c)", 5.0),
        ("known(missing, 5)", 5.0),
        ("known(missing + a, known(other, a))", 2.0),
    ],
)
def test_expressions_come_to_what_they_say(text: str, number: float) -> None:
    assert Expression(text).number(VALUES) == number


def test_an_angle_is_turned_to_within_half_a_turn() -> None:
    assert abs(Expression("turned(3 * atan2(0, -1))").number(VALUES)) == pytest.approx(3.141592653589793)


def test_an_expression_names_what_it_speaks_of() -> None:
    expression = Expression("a > 1 and (r.c.z == 'x' or a < max(known(d.active, 1), e))")
    assert expression.names == ("a", "r.c.z", "d.active", "e")


@pytest.mark.parametrize(
    "text", ["1 / e", "r.c.z + 1", "r.c.z", "some", "1e308 * 1e308", "min(a)", "r.c.z * 3", "3 * some", "-r.c.z"]
)
def test_what_the_values_do_not_fit_cannot_be_computed(text: str) -> None:
    with pytest.raises(NotComputable):
        Expression(text).number(VALUES)


@pytest.mark.parametrize("text", ["missing", "a.b", "known(missing, other)", "b + 1"])
def test_a_name_without_a_value_makes_the_whole_unknown(text: str) -> None:
    with pytest.raises(Unknown, match="is not known") as failure:
        Expression(text).value(VALUES)
    assert not isinstance(failure.value, NotComputable)


@pytest.mark.parametrize(
    "text",
    ["", "a >", "a b", "a = 1", "[1]", "[a.x]", "a[0]", "(lambda: 1)()", "lambda: 1", "open('f')", "__import__('os')",
     "().__class__", "'x'.join", "f'{a}'", "known(a)", "2 ** 99", "a ** 9", "a // 2", "a % 2", "a in b.c", "a is b",
     "~1", "+1", "max(*a)", "abs(x=1)", "min.max(1, 2)", "(a)(1)", "None", "...", "b'x'", "a < 1j", "1e999",
     "abs(1, 2)", "atan2(1)", "min()", "hypot()",
     "1" * 2000, "1" * 2001, "+".join("a" * 500), "(" * 300, "-" * 300 + "a", "not " * 400 + "a",
     "max(" + ",".join("1" * 500) + ")"],
)  # fmt: skip
def test_what_has_no_place_in_an_expression_is_refused(text: str) -> None:
    with pytest.raises(BadMessage):
        Expression(text)


@pytest.mark.parametrize("text", ["~" * 1900 + "a.b", "f()" + ".b" * 900], ids=["signs", "names"])
def test_what_is_nested_too_deep_to_be_shown_is_refused_too(text: str) -> None:
    with pytest.raises(BadMessage):
        Expression(text)


def test_a_refusal_shows_what_is_wrong_and_what_there_is() -> None:
    for text, told in (
        ("1 +", "'1 +' is no expression: invalid syntax"),
        ("1 + a ** 2", "'a ** 2' has no place in an expression"),
        ("open('f')", "'open' is no function; there are: min, max, abs, hypot, atan2, turned, known"),
        ("1 + atan2(a)", "'atan2(a)': atan2 takes 2, not 1 values"),
        ("a" * 2001, "has 2001 characters, must have at most 2000"),
        ("-" * 300 + "a", "is nested more than 140 deep"),
    ):
        with pytest.raises(BadMessage) as failure:
            Expression(text)
        assert str(failure.value) == told


@given(st.text(max_size=30))
def test_no_text_does_harm(text: str) -> None:
    with suppress(BadMessage, Unknown):
        Expression(text).number(VALUES)


@given(st.floats(-1e3, 1e3), st.floats(-1e3, 1e3))
def test_arithmetic_is_pythons(x: float, y: float) -> None:
    names = {"x": x, "y": y}
    assert Expression("x * y - y + x").number(names) == x * y - y + x
    assert Expression("x < y or x == y").value(names) is (x <= y)


@pytest.mark.parametrize(
    ("text", "renamed"),
    [
        ("(mode == 'a' and\x0c\n x)", "(q.mode == 'a' and\x0c\n q.x)"),
        ("mode == 'a\x1cb' and x", "q.mode == 'a\x1cb' and q.x"),
        ("(mode and\r\n x)", "(q.mode and\r\n q.x)"),
    ],
)
def test_names_are_changed_where_they_stand_whatever_white_space_there_is(text: str, renamed: str) -> None:
    assert Expression(text).renamed(lambda name: f"q.{name}") == renamed
