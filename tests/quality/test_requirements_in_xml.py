"""Requirements that are written in XML alone: what can be required, and what cannot."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from behavior_tree import LoadError
from regraft.services.bt_executor.quality.requirement_text import parse_requirement
from tests.quality.helpers import Field, system, task

SAFELY = "{@nearest} at least 0.46 or {@speed} at most 0.18"


def judged(value: float, board: dict[str, float] | None = None, **ports: str) -> tuple[float | None, bool | None]:
    """Return degree and satisfaction of a value."""
    field = Field(task(value="{@value}", **ports), board={"value": value, **(board or {})})
    field.tick()
    told = field.quality("QR")
    return told.degree, told.satisfied


@pytest.mark.parametrize(
    ("ports", "value", "degree", "satisfied"),
    [
        ({"at_least": "0.1"}, 0.1, 1.0, True),
        ({"at_least": "0.1"}, 0.09, 0.0, False),
        ({"at_most": "0.1"}, 0.1, 1.0, True),
        ({"at_most": "0.1"}, 0.11, 0.0, False),
        ({"at_least": "1", "at_most": "2"}, 1.5, 1.0, True),
        ({"at_least": "1", "at_most": "2"}, 2.5, 0.0, False),
        ({"at_least": "1", "within": "0.5"}, 1.25, 0.75, True),
        ({"at_least": "1", "within": "0.5"}, 0.75, 0.25, False),
        ({"as_close_as_possible_to": "0.26", "within": "0.08"}, 0.18, 0.5, True),
        ({"as_close_as_possible_to": "0.26", "within": "0.08"}, 0.14, 0.25, False),
        ({"as_few_as_possible": "40"}, 20.0, 0.75, True),
        ({"as_few_as_possible": "40"}, 60.0, 0.25, False),
        ({"as_many_as_possible": "4"}, 6.0, 0.75, True),
        ({"as_early_as_possible": "10"}, 15.0, 0.25, False),
        ({"as_late_as_possible": "10"}, 15.0, 0.75, True),
        ({}, 15.0, None, None),
        ({"requirement": "at least 1 and not at least 2"}, 1.5, 1.0, True),
        ({"requirement": "at least 1 and not at least 2"}, 2.0, 0.0, False),
        ({"requirement": "2 at least 1"}, 0.0, 1.0, True),
        ({"requirement": "(at least 3 or at most 1) and as close as possible to 0 within 1"}, 1.0, 0.5, True),
    ],
)
def test_a_value_satisfies_what_the_ports_require(
    ports: dict[str, str], value: float, degree: float | None, satisfied: bool | None
) -> None:
    found = judged(value, None, **ports)
    assert found == (pytest.approx(degree) if degree is not None else None, satisfied)


@pytest.mark.parametrize(
    ("nearest", "speed", "satisfied"),
    [(0.5, 0.26, True), (0.4, 0.26, False), (0.4, 0.1, True), (0.46, 0.26, True), (0.4, 0.18, True)],
)
def test_a_text_can_ask_several_entries(nearest: float, speed: float, satisfied: bool) -> None:
    board = {"nearest": nearest, "speed": speed}
    assert judged(1.0, board, requirement=SAFELY)[1] is satisfied


def test_bounds_may_come_from_the_blackboard_and_are_read_afresh() -> None:
    field = Field(task(value="{@value}", at_most="{@limit}"), board={"value": 3.0, "limit": 4.0})
    field.tick()
    assert field.quality("QR").satisfied is True
    field.put("limit", 2.0)
    field.tick()
    assert field.quality("QR").satisfied is False


def test_an_entry_that_a_text_asks_must_have_data_that_are_not_stale() -> None:
    field = Field(task(value="1", stale_after="1", requirement=SAFELY), board={"nearest": 1.0})
    field.tick()
    assert (field.quality("QR").satisfied, field.quality("QR").reason) == (None, "there are no data in '@speed'")
    field.put("speed", 0.1)
    field.tick(0.5)
    assert field.quality("QR").satisfied is True
    field.tick(1.0)
    assert field.quality("QR").status == "unknown"


def test_without_a_value_the_time_of_the_task_is_measured() -> None:
    field = Field(task("<Spelt script='RRS'/>", as_early_as_possible="2"))
    field.tick(5.0)
    assert (field.quality("QR").metric, field.quality("QR").degree) == (0.0, 1.0)
    field.tick(1.5)
    assert (field.quality("QR").metric, field.quality("QR").satisfied) == (1.5, True)
    field.tick(1.5)
    assert (field.quality("QR").metric, field.quality("QR").satisfied) == (3.0, False)
    assert not field.quality("QR").active


def test_an_integral_is_a_sum_over_the_run_and_told_at_its_end() -> None:
    power = task("<Spelt script='RRRS'/>", value="{@power}", measure="integral", at_most="20", metric="{energy}")
    field = Field(power, board={"power": 5.0})
    field.tick()
    field.tick(2.0)
    assert field.get("energy") == 10.0
    field.put("power", 7.0)
    field.tick(0.0)
    field.tick(1.0)
    assert (field.get("energy"), field.quality("QR").satisfied, field.quality("QR").active) == (17.0, True, False)
    field.tick(60.0)
    assert field.get("energy") == 0.0


WRONG = [
    (task(), "needs the port value"),
    (task(value="1", at_least="x"), "port 'at_least': 'x' is neither a number nor a blackboard key"),
    (task(value="1", as_close_as_possible_to="1"), "needs 'within'"),
    (task(value="1", as_close_as_possible_to="1", within="0"), "tolerance 'within' above 0"),
    (task(value="1", as_few_as_possible="-1"), "tolerance 'within' above 0"),
    (task(value="1", within="1"), "'within' needs something that it is the tolerance of"),
    (task(value="1", at_least="2", at_most="1"), "nothing could satisfy both"),
    (task(value="1", at_least="1", as_few_as_possible="3"), "do not go together"),
    (task(value="1", requirement="at least 1", at_most="3"), "leave at_most out"),
    (task(value="1", requirement="at least"), "it ends where a number behind 'at least' should be"),
    (task(value="1", requirement="at least {@x"), "a brace is missing"),
    (task(value="1", requirement="at least 1 2"), "'2' is not understood here"),
    (task(value="1", requirement="{@x} more than 2"), "a relation is missing: one of 'at least'"),
    (task(value="1", requirement="(at least 1"), "a '\\)' is missing"),
    (task(value="1", requirement=""), "it ends where"),
    (task(value="1", requirement="(" * 50 + "at least 1" + ")" * 50), "nested more than 20"),
    (task(value="1", measure="sum"), "port 'measure' is 'sum'; it must be one of value, integral"),
    (task(value="1", measure="{how}"), "must be a literal"),
    (task(measure="integral", as_early_as_possible="3"), "needs a value to measure"),
    (task(value="1", weight="-1"), "weight is -1; it must be 0 or more"),
    (task(value="1", weight="heavy"), "port 'weight' is of type float"),
    (task(value="1", stale_after="-2"), "stale_after is -2"),
    (task(value="1", quality_attribute=""), "needs quality_attribute"),
    (task(value="1", at_laest="1"), "has no port 'at_laest'"),
    (system("<Spelt/>"), "needs a value, or combine"),
    (system("<Spelt/>", combine="total"), "port 'combine' is 'total'; it must be one of sum, mean"),
    (task("<Spelt/><Spelt/>", value="1"), "needs exactly 1 child"),
]


@pytest.mark.parametrize(("body", "why"), WRONG, ids=[why for _, why in WRONG])
def test_what_makes_no_sense_is_an_error_at_load_with_its_place(body: str, why: str) -> None:
    with pytest.raises(LoadError, match=why) as refused:
        Field(body)
    assert refused.value.line == 2


@given(st.text(alphabet="{}()@ab 01.-ornt", max_size=40) | st.text(max_size=40))
def test_any_text_is_a_requirement_or_refused(text: str) -> None:
    try:
        parse_requirement(text)
    except ValueError as error:
        assert str(error)
