"""The space of options: all that the constraints allow, and nothing else."""

from __future__ import annotations

import operator
from itertools import pairwise, product
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from regraft.adaptation_manager.planners.choices.settings import Kind
from regraft.adaptation_manager.planners.choices.slots import Slot, option_of, varied
from regraft.adaptation_manager.planners.choices.space import options_of
from regraft.bus_schema.errors import BadMessage

SIGNS = {
    "<": operator.lt,
    "<=": operator.le,
    ">": operator.gt,
    ">=": operator.ge,
    "==": operator.eq,
    "!=": operator.ne,
}


def dimension(name: str, *choices: Any) -> Slot:
    return varied("part", Kind.PARAMETER, name, choices, name)


# --- an interpreter of constraints that is as simple as can be ---


def passes(test: Any, value: Any) -> bool:
    if isinstance(test, dict):
        return all(SIGNS[sign](value, wanted) for sign, wanted in test.items())
    return value in test if isinstance(test, list) else bool(value == test)


def all_pass(when: dict[str, Any], option: dict[str, Any]) -> bool:
    return all(passes(test, option[name]) for name, test in when.items())


def allows(constraint: dict[str, Any], option: dict[str, Any]) -> bool:
    if "forbid" in constraint:
        return not all_pass(constraint["forbid"], option)
    if "if" in constraint:
        return not all_pass(constraint["if"], option) or all_pass(constraint["then"], option)
    left, sign, right = constraint["compare"]
    return bool(SIGNS[sign](option[left], option[right] if isinstance(right, str) else right))


# Strategies are built once: to build one takes longer than to draw from it.
NAMES = ("a", "b", "c", "d")
ORDERS = ("<", "<=", ">", ">=")
NUMBER = st.integers(0, 5)
CHOICES = st.lists(NUMBER, min_size=1, max_size=4, unique=True)
HOW_MANY_NAMES, ONE_OR_TWO = st.integers(1, 4), st.integers(1, 2)
ONE_OF = {count: st.integers(0, count - 1) for count in range(1, 5)}
SOME_OF = {
    count: st.lists(st.sampled_from(NAMES[:count]), min_size=1, max_size=3, unique=True) for count in range(1, 5)
}
ORDER_OF = {count: st.permutations(NAMES[:count]) for count in range(1, 5)}
ORDER, SIGN = st.sampled_from(ORDERS), st.sampled_from(list(SIGNS))
BOUNDS = st.dictionaries(ORDER, NUMBER, min_size=1, max_size=2)
TEST = st.sampled_from(("value", "values", "bounds"))
FORMS = st.lists(st.sampled_from(("forbid", "if", "compare")), max_size=5)


@st.composite
def spaces(draw: st.DrawFn) -> tuple[list[Slot], list[dict[str, Any]]]:
    """Draw up to four dimensions of up to four numbers, and up to five constraints on them."""
    count = draw(HOW_MANY_NAMES)
    choices = {name: draw(CHOICES) for name in NAMES[:count]}

    def test_of(values: list[int]) -> Any:
        form = draw(TEST)
        if form == "bounds":
            return draw(BOUNDS)
        picked = [values[draw(ONE_OF[len(values)])] for _ in range(draw(ONE_OR_TWO) if form == "values" else 1)]
        return picked if form == "values" else picked[0]

    def when() -> dict[str, Any]:
        return {name: test_of(choices[name]) for name in draw(SOME_OF[count])}

    constraints: list[dict[str, Any]] = []
    for form in draw(FORMS):
        if form == "forbid":
            constraints.append({"forbid": when()})
        elif form == "if":
            constraints.append({"if": when(), "then": when()})
        else:
            left, right = draw(ORDER_OF[count])[:2] if count > 1 else (NAMES[0], draw(NUMBER))
            constraints.append({"compare": [left, draw(SIGN if count > 1 else ORDER), right]})
    return [dimension(name, *values) for name, values in choices.items()], constraints


@given(spaces())
@settings(max_examples=200, deadline=None)
def test_the_options_are_the_filtered_product_in_its_order(space: tuple[list[Slot], list[Any]]) -> None:
    dimensions, constraints = space
    names = [d.name for d in dimensions]
    feasible = [
        values
        for values in product(*(d.values for d in dimensions))
        if all(allows(constraint, dict(zip(names, values, strict=True))) for constraint in constraints)
    ]
    if feasible:
        assert [option.values for option in options_of(dimensions, constraints)] == feasible
        return
    with pytest.raises(BadMessage, match="no option") as refused:
        options_of(dimensions, constraints)
    for index in range(len(constraints)):
        fewer = constraints[:index] + constraints[index + 1 :]
        named = f"constraint {index}," in str(refused.value)
        possible = any(
            all(allows(c, dict(zip(names, values, strict=True))) for c in fewer)
            for values in product(*(d.values for d in dimensions))
        )
        assert named or not possible, "a constraint without which there are options must be named"


def test_few_options_in_a_product_beyond_counting_are_found() -> None:
    dimensions = [dimension(f"d{index}", *range(10)) for index in range(40)]
    ascending = [{"compare": [f"d{index}", "<=", f"d{index + 1}"]} for index in range(39)]
    found = options_of(dimensions, [*ascending, {"if": {"d0": {">=": 0}}, "then": {"d39": {"<=": 1}}}])
    assert len(found) == 41


def test_what_follows_from_a_choice_is_followed_before_anything_else_is_tried() -> None:
    """A chain of conditions that jumps to and fro through the dimensions."""
    dimensions = [dimension(f"d{index}", *range(10)) for index in range(30)]
    order = [index // 2 + 15 * (index % 2) for index in range(30)]
    chain = [
        {"if": {f"d{one}": value}, "then": {f"d{other}": value}}
        for one, other in pairwise(order)
        for value in range(10)
    ]
    assert [option.values for option in options_of(dimensions, chain)] == [(value,) * 30 for value in range(10)]


def test_an_impossible_corner_is_found_however_large_the_rest() -> None:
    free = [dimension(f"free{index}", *range(50)) for index in range(30)]
    pigeons = [dimension(f"pigeon{index}", 0, 1, 2) for index in range(4)]
    apart = [{"compare": [f"pigeon{i}", "!=", f"pigeon{j}"]} for i in range(4) for j in range(i)]
    with pytest.raises(BadMessage, match=r"together leave no option: change one of them") as refused:
        options_of([*free, *pigeons], apart)
    assert all(f"constraint {index}," in str(refused.value) for index in range(6))


def test_the_refusal_names_the_one_constraint_that_empties_the_space_and_its_reason() -> None:
    dimensions = [dimension("speed", 0.1, 0.2), dimension("pictures", 1, 3)]
    constraints = [
        {"forbid": {"speed": 0.2, "pictures": 3}},
        {"compare": ["speed", ">", 0.5], "because": "the tide waits for nobody"},
    ]
    with pytest.raises(BadMessage) as refused:
        options_of(dimensions, constraints)
    assert str(refused.value) == (
        "constraints: constraint 1, {'compare': ['speed', '>', 0.5]}, because the tide waits for nobody, leaves no"
        " option: change it"
    )


def test_too_many_options_are_refused_with_their_number() -> None:
    dimensions = [dimension(f"d{index}", *range(10)) for index in range(5)]
    with pytest.raises(BadMessage, match="there are 100000 options, must be at most 10000"):
        options_of(dimensions, [])
    with pytest.raises(BadMessage, match="more than 10000 options"):
        options_of(dimensions, [{"compare": [f"d{i}", "<=", f"d{i + 1}"]} for i in range(2)] + [
            {"if": {f"d{i}": 0}, "then": {f"d{i + 1}": [0, 1, 2, 3]}} for i in range(4)
        ])  # fmt: skip
    assert len(options_of(dimensions[:4], [])) == 10_000


def test_a_tangle_without_end_is_given_up_and_said() -> None:
    """Nine pigeons in eight holes: every way is a dead end, and there are a great many."""
    pigeons = [dimension(f"p{index}", *range(9)) for index in range(10)]
    apart = [{"compare": [f"p{i}", "!=", f"p{j}"]} for i in range(10) for j in range(i)]
    with pytest.raises(BadMessage, match="no end was found in 400000 steps"):
        options_of(pigeons, apart)


@pytest.mark.parametrize(
    ("constraint", "where", "said"),
    [
        ({"forbid": {"sped": 0.1}}, "0.forbid.sped", "there is no dimension 'sped'; did you mean 'speed'?"),
        ({"forbid": {"speed": 0.3}}, "0.forbid.speed", "0.3 is none of its choices, which are: 0.1, 0.2"),
        ({"forbid": {"speed": [0.1, 7]}}, "0.forbid.speed", "7 is none of its choices"),
        ({"forbid": {"speed": {"=<": 1}}}, "0.forbid.speed", "must be a value, a list of values, or have: < <= > >="),
        ({"forbid": {}}, "0.forbid", "must map names of dimensions"),
        ({"if": {"speed": 0.1}}, "0", "must have 'forbid', or 'if' and 'then', or 'compare'"),
        ({"if": {"speed": 0.1}, "then": {"camera": 1}}, "0.then.camera", "'a' is given|1 is none of its choices"),
        ({"if": {"camera": {"<": 1}}, "then": {"speed": 0.1}}, "0.if.camera", "'<' is for numbers, but 'camera' has"),
        ({"compare": ["speed", "<", "camera"]}, "0.compare", "'<' is for numbers, but 'camera' has 'near'"),
        ({"compare": ["speed", "~", 1]}, "0.compare", "there is no operator '~'"),
        ({"compare": ["speed", "<"]}, "0.compare", r"must be \[dimension, operator, dimension or number\]"),
        ({"compare": ["speed", "<", "speed"]}, "0.compare", "with itself"),
        ({"forbid": {"speed": 0.1}, "because": 3}, "0.because", "must be text"),
        ("never", "0", "must have 'forbid'"),
    ],
)
def test_a_bad_constraint_is_refused_saying_where_and_what_would_be_right(
    constraint: Any, where: str, said: str
) -> None:
    dimensions = [dimension("speed", 0.1, 0.2), dimension("camera", "near", "far")]
    with pytest.raises(BadMessage, match=said) as refused:
        options_of(dimensions, [constraint])
    assert ".".join(refused.value.where) == f"constraints.{where}"


def test_an_option_is_known_by_its_content() -> None:
    speed, ways = dimension("speed", 0.1, 1.0), dimension("way", "fast")
    key = option_of([speed, ways], [1, 0]).key
    renamed = varied("part", Kind.PARAMETER, "speed", (1,), "v")
    assert option_of([ways, renamed], [0, 0]).key == key
    assert option_of([speed, ways], [0, 0]).key != key
    assert option_of([dimension("flag", True)], [0]).key != option_of([dimension("flag", 1)], [0]).key
