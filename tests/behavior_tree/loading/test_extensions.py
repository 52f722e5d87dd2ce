"""Scripts and ports can more than BehaviorTree.CPP's, but not in strict trees."""

from typing import Any
from xml.sax.saxutils import quoteattr

import pytest
from hypothesis import given
from hypothesis import strategies as st

from behavior_tree import (
    SUCCESS,
    Blackboard,
    BlackboardError,
    Input,
    LoadError,
    NodeError,
    Output,
    Registry,
    ScriptError,
    Status,
    SyncAction,
    Tree,
    UInt8,
    UInt16,
    UInt32,
    UInt64,
    load_text,
)
from behavior_tree.data.values import INT64_MAX, UNSIGNED_MAX, to_type
from behavior_tree.script import compile_script
from tests.behavior_tree.trees import document

NUMBERS = st.integers(-(2**31), 2**31) | st.floats(-1e6, 1e6)


def value(script: str, enums: dict[str, int] | None = None, extensions: bool = True, **entries: Any) -> Any:
    """Return the value of a script on a board with entries."""
    board = Blackboard()
    for key, given_value in entries.items():
        board.set(key, given_value)
    return compile_script(script, board, enums or {}, extensions=extensions)()


def test_a_status_has_a_number_by_its_name() -> None:
    assert [value(name) for name in ("IDLE", "RUNNING", "SUCCESS", "FAILURE", "SKIPPED")] == [0.0, 1.0, 2.0, 3.0, 4.0]
    assert value("result == SUCCESS ? 'yes' : 'no'", result=SUCCESS) == "yes"


def test_an_entry_or_an_enumerated_name_goes_before_a_status() -> None:
    assert value("SUCCESS", SUCCESS=7) == 7
    assert value("SUCCESS", {"SUCCESS": 9}) == 9.0
    assert value("RUNNING := 5; RUNNING + 1") == 6.0


@given(NUMBERS, NUMBERS, NUMBERS)
def test_functions_give_what_they_mean_as_reals(a: float, b: float, c: float) -> None:
    assert value("abs(a)", a=a) == abs(float(a))
    assert value("min(a, b)", a=a, b=b) == min(float(a), float(b))
    assert value("max(a, b, c - 1)", a=a, b=b, c=c) == max(float(a), float(b), float(c) - 1)
    assert isinstance(value("max(a, b)", a=a, b=b), float)


def test_functions_nest_and_take_any_expression() -> None:
    assert value("max(abs(-3), min(1 + 1, 10)) * 2 > 5 ? 'far' : 'near'") == "far"
    assert value("x := min(7, 9); x += abs(x)") == 14.0


def test_a_name_with_a_blank_behind_it_is_an_entry_as_before() -> None:
    assert value("abs (3)", abs=1) == 3
    assert value("min + 1", min=1) == 2.0


@pytest.mark.parametrize(
    ("script", "told"),
    [
        ("abs()", "expected a value"),
        ("abs(1, 2)", "abs takes exactly 1 values, it has 2"),
        ("min(1)", "min takes at least 2 values, it has 1"),
        ("max(1 2)", "expected ')'"),
        ("max(1,)", "expected a value"),
        ("max(1,2", "expected ')'"),
        ("1, 2", "expected a value"),
        ("abs('a')", "'abs' does not work on 'a'"),
        ("min(nothing, 1)", "no blackboard entry 'nothing'"),
        ("abs(1) := 2", "left side of ':=' must be a name"),
        (f"max({','.join('1' * 101)})", "it has 101"),
        ("abs(" * 5000, "nested too deeply"),
    ],
)
def test_a_faulty_call_is_refused(script: str, told: str) -> None:
    with pytest.raises(ScriptError) as refused:
        value(script)
    assert told in refused.value.message


@pytest.mark.parametrize("script", ["min(1, 2)", "abs(-1)", "SUCCESS", "x := FAILURE", "+5", 'x := "a"', "größe := 1"])
def test_a_strict_tree_refuses_what_btcpp_would(script: str) -> None:
    with pytest.raises(ScriptError):
        value(script, extensions=False)
    text = document(f"<Script code={quoteattr(script)}/>")
    with pytest.raises((LoadError, NodeError)):
        load_text(text, Registry(), strict=True).tick_once()
    assert load_text(text, Registry()).tick_once() == SUCCESS


@pytest.mark.parametrize(
    ("script", "wanted"),
    [
        ("\"double\" .. ' single'", "double single"),
        ('"it\'s"', "it's"),
        ("+5", 5),
        ("2 - +1.5", 0.5),
        ("größe := 1", 1),
    ],
)
def test_scripts_are_read_that_btcpp_refuses(script: str, wanted: object) -> None:
    result = value(script)
    assert (type(result), result) == (type(wanted), wanted)


def test_conditions_use_the_extensions_too() -> None:
    text = document('<AlwaysFailure _successIf="max(1, 2) == SUCCESS"/>')
    assert load_text(text, Registry()).tick_once() == SUCCESS
    with pytest.raises(LoadError, match="_successIf"):
        load_text(text, Registry(), strict=True)


class Count(SyncAction):
    """Passes a small number on."""

    small = Input(UInt8)
    large = Output(UInt16)

    def tick(self) -> Status:
        """Do it."""
        self.large = UInt16(self.small)
        return SUCCESS


class Signed(SyncAction):
    """Reads a number of any sign."""

    number = Input(int)

    def tick(self) -> Status:
        """Do it."""
        return SUCCESS if self.number is not None else Status(0)


def counting(body: str) -> Tree:
    """Load a sequence with the two nodes."""
    registry = Registry()
    registry.register_all([Count, Signed])
    return load_text(document(f"<Sequence>{body}</Sequence>"), registry)


@pytest.mark.parametrize("text", ["-1", "256", "1.5", "many"])
def test_a_literal_that_an_unsigned_port_cannot_have_is_refused_at_load(text: str) -> None:
    with pytest.raises(LoadError, match="port 'small' is of type uint8_t"):
        counting(f'<Count small="{text}"/>')


def test_an_entry_that_does_not_fit_is_refused_where_it_is_read() -> None:
    tree = counting(
        '<Script code="n := 200"/><Count small="{n}" large="{m}"/>'
        '<Script code="n -= 201"/><Count small="{n}" large="{m}"/>'
    )
    with pytest.raises(NodeError, match="-1 is not a whole number from 0 to 255"):
        tree.tick_once()


@pytest.mark.parametrize("order", [("Count large", "Signed number"), ("Signed number", "Count large")])
def test_ports_with_and_without_sign_share_an_entry(order: tuple[str, str]) -> None:
    first, second = (f'<{port}="{{n}}" {"small" if "Count" in port else "_x"}="7"/>' for port in order)
    tree = counting(f"<Count small='7' large='{{n}}'/>{first}{second}")
    assert (tree.tick_once(), tree.blackboard.get("n")) == (SUCCESS, 7)


def test_an_entry_of_an_unsigned_type_cannot_be_written_below_zero() -> None:
    tree = counting('<Count small="7" large="{n}"/>')
    for wrong in (-1, 65536, 2.5):
        with pytest.raises(BlackboardError, match="is of type uint16_t"):
            tree.blackboard.set("n", wrong)


@given(st.sampled_from(list(UNSIGNED_MAX)), st.integers(-(2**70), 2**70))
def test_an_unsigned_type_has_the_numbers_from_0_to_its_largest(kind: Any, number: int) -> None:
    fits = 0 <= number <= UNSIGNED_MAX[kind]
    for given_value in (number, str(number)):
        try:
            assert to_type(given_value, kind, {}) == number
            assert fits
        except ValueError:
            assert not fits


def test_the_largest_numbers_are_those_of_8_16_32_and_63_bits() -> None:
    assert [UNSIGNED_MAX[kind] for kind in (UInt8, UInt16, UInt32, UInt64)] == [255, 65535, 2**32 - 1, INT64_MAX]
