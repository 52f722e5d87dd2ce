"""An expression that is no condition, no number, or can never be computed is known by the kinds of its names."""

from __future__ import annotations

from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from regraft.bus_schema.encoding.reading_checks import ValueKind
from regraft.bus_schema.errors import BadMessage
from regraft.bus_schema.model.expression_kinds import kind_of, kind_problems
from regraft.bus_schema.model.expressions import Expression, NotComputable, Unknown

TRUTH, NUMBER, TEXT = ValueKind.TRUTH, ValueKind.NUMBER, ValueKind.TEXT
KINDS = {"n": NUMBER, "t": TEXT, "b": TRUTH, "a.rate": NUMBER}
VALUES = {"n": 2.0, "t": "fast", "b": True, "a.rate": 5}


@pytest.mark.parametrize(
    ("text", "kind"),
    [
        ("5", NUMBER), ("True", TRUTH), ("'x'", TEXT), ("n < 3 <= a.rate", TRUTH), ("not b or n > 1", TRUTH),
        ("-n * 2 + b", NUMBER), ("t + 'er'", TEXT), ("n if b else 0", NUMBER), ("n if b else t", None),
        ("known(b, False)", TRUTH), ("known(unknown, 1)", None), ("max(n, 1)", NUMBER), ("unknown", None),
        ("hypot(unknown, n)", NUMBER), ("unknown + 1", NUMBER), ("unknown + other", None), ("min(unknown)", None),
    ],
)  # fmt: skip
def test_the_kind_of_an_expression_follows_from_its_names(text: str, kind: ValueKind | None) -> None:
    assert kind_of(Expression(text), KINDS) is kind
    assert kind_problems(Expression(text), KINDS) == []


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ("5", "5 is a number, must be true or false, such as: NAME > 5"),
        ("a.rate", "a.rate is a number, must be true or false, such as: a.rate > 0"),
        ("b and n + 1", "n + 1 is a number, must be true or false, such as: n + 1 > 0"),
        ("t", "t is a text, must be true or false, such as: t == 'a text'"),
        ("not 'x'", "'x' is a text, must be true or false, such as: NAME == 'x'"),
        ("t == 3", "t, a text, is compared with 3, a number: both must be of one kind"),
        ("1 < n < 'x'", "n, a number, is compared with 'x', a text: both must be of one kind"),
        ("t * 2 > 1", "t is a text, must be a number"),
        ("abs(t) > 1", "t is a text, must be a number"),
        ("b if n else b", "n is a number, must be true or false, such as: n > 0"),
    ],
)
def test_what_is_no_condition_is_named_with_what_would_be(text: str, problem: str) -> None:
    assert kind_problems(Expression(text), KINDS, TRUTH) == [problem]


PARTS = st.recursive(
    st.sampled_from(["1", "'x'", "True", "n", "t", "b", "unknown"]),
    lambda inner: st.one_of(
        st.tuples(inner, st.sampled_from(["+", "*", "<", "==", "and", "or"]), inner).map(lambda p: f"({' '.join(p)})"),
        inner.map(lambda part: f"(not {part})"),
        st.tuples(inner, inner).map(lambda pair: f"min({', '.join(pair)})"),
        st.tuples(inner, inner, inner).map(lambda p: f"({p[0]} if {p[1]} else {p[2]})"),
    ),
    max_leaves=8,
)


@given(PARTS)
def test_an_expression_without_problems_has_a_value_of_its_kind(text: str) -> None:
    expression = Expression(text)
    if kind_problems(expression, KINDS):
        return
    kind = kind_of(expression, KINDS)
    try:
        value = expression.value(VALUES)
    except NotComputable:
        # Only a part of any kind may turn out not to fit.
        assert any(part in text for part in ("unknown", " if ", "min("))
    except Unknown:
        assert "unknown" in expression.names
    else:
        types: dict[ValueKind | None, Any] = {TRUTH: bool, NUMBER: (bool, int, float), TEXT: str, None: object}
        assert isinstance(value, types[kind])


def test_a_deep_expression_is_read_at_once() -> None:
    for text in ("(" * 60 + "n" + " + 1)" * 60, "max(1, " * 60 + "n" + ")" * 60, "known(" * 60 + "n" + ", 1)" * 60):
        try:
            assert kind_of(Expression(text), KINDS) is NUMBER
        except BadMessage as error:
            raise AssertionError(text) from error
