"""Whatever a file holds, reading it gives a stack or a StackError."""

from __future__ import annotations

import tempfile
from pathlib import Path

from hypothesis import given, settings
from hypothesis import strategies as st

from regraft.stack import StackError, apply_overrides, load
from tests.stack.reading.files import GOOD

PIECES = st.sampled_from(
    [
        *GOOD.split(),
        "\n",
        "  ",
        "- ",
        ": ",
        "{",
        "}",
        "[",
        "]",
        "&a ",
        "*a",
        "'",
        "~",
        "-1",
        ".nan",
        "1e999",
        "!t ",
        "\t",
    ]
)
LINES = GOOD.splitlines(keepends=True)
VALUES = st.sampled_from(
    ["~", "[]", "{}", "7", "-1.5", ".inf", "true", "''", "some text", "[1, a]", "{a: {b: c}}", "&a [*a]"]
)


def loads_or_refuses(data: bytes) -> None:
    """Load a file of these bytes; any error but StackError comes through."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "stack.yaml"
        file.write_bytes(data)
        try:
            load(file)
        except StackError as error:
            assert error.problems
            assert all(problem.problem and problem.file == str(file) for problem in error.problems)


@given(st.binary(max_size=200))
def test_random_bytes_are_refused_cleanly(data: bytes) -> None:
    loads_or_refuses(data)


@settings(max_examples=100)
@given(st.integers(0, len(GOOD)), st.integers(0, 40), st.lists(PIECES, max_size=4))
def test_good_file_with_a_piece_replaced_loads_or_is_refused_cleanly(at: int, gone: int, pieces: list[str]) -> None:
    loads_or_refuses((GOOD[:at] + "".join(pieces) + GOOD[at + gone :]).encode())


@settings(max_examples=100)
@given(st.lists(st.integers(0, len(LINES) - 1), max_size=6), st.integers(0, len(LINES) - 1))
def test_good_file_with_lines_lost_and_moved_loads_or_is_refused_cleanly(lost: list[int], moved: int) -> None:
    kept = [line for number, line in enumerate(LINES) if number not in lost]
    loads_or_refuses("".join([*kept, LINES[moved]]).encode())


@settings(max_examples=100)
@given(st.integers(0, len(LINES) - 1), VALUES)
def test_good_file_with_any_value_anywhere_loads_or_is_refused_cleanly(number: int, value: str) -> None:
    key, colon, _ = LINES[number].partition(":")
    lines = [*LINES[:number], f"{key}{colon} {value}\n", *LINES[number + 1 :]]
    loads_or_refuses("".join(lines).encode())


@given(st.text(max_size=60))
def test_any_override_is_applied_or_refused_cleanly(text: str) -> None:
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "stack.yaml"
        file.write_text(GOOD)
        stack = load(file)
    for override in (text, f"world.{text}", f"world.tick_rate={text}", f"rescuer.navigator.gains=[{text}]"):
        try:
            apply_overrides(stack, [override])
        except StackError as error:
            assert error.problems
