"""A recorder writes one row a second, equal for equal runs."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from regraft.bus_schema.messages.geometry import Twist, Vector3
from regraft.evaluation.rows import Cell, read_rows, written
from regraft.testing import Rig
from tests.evaluation.tiny_parts import CountRecorder


def recorded(file: Path, seconds: float = 3.0) -> bytes:
    with Rig() as rig:
        rig.add(CountRecorder, "rows", {"file": str(file)})
        for number in range(int(seconds)):
            rig.publish("count", Twist(Vector3(number / 3.0)))
            rig.advance(1.0)
    return file.read_bytes()


def test_there_is_a_row_for_every_second_and_equal_runs_have_equal_files(tmp_path: Path) -> None:
    assert recorded(tmp_path / "a.csv") == recorded(tmp_path / "b.csv")
    rows = read_rows(tmp_path / "a.csv")
    assert rows.number("time") == [1.0, 2.0, 3.0]
    assert rows.number("heard")[-1] == 1.0
    assert rows.is_so("even")[-1] is False


def test_a_file_that_is_there_is_never_written_over(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text("mine\n")
    with Rig() as rig:
        rig.add(CountRecorder, "rows", {"file": str(tmp_path / "a.csv")})
        rig.advance(2.0)
        fault, _ = rig.take_faults()
    assert fault.startswith("rows: on_activate: FileExistsError")
    assert (tmp_path / "a.csv").read_text() == "mine\n"


def test_a_line_cut_short_is_told(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text("time,number\n1,2\n2\n")
    with pytest.raises(ValueError, match="line 3: has 1 fields, must have 2"):
        read_rows(tmp_path / "a.csv")


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ("time,number\n1,2\n2,4\n34,8\n5,10\n", "line 4: its time '34' is not a second after '2'"),
        ("time,number\n1,2\n2,4\n4,8\n", "line 4: its time '4' is not a second after '2'"),
        ("time,number\n1,2\n2,4\n2,4\n", "line 4: its time '2' is not a second after '2'"),
        ("number,time\n2,1\n4,x\n", "line 3: its time 'x' is not a second after '1'"),
        ("time,number\n1,2.5\n2,4", "line 3: has no end"),
    ],
    ids=["a row that begins as another", "a missing row", "a row twice", "no number", "a last row cut short"],
)
def test_rows_of_which_a_part_is_missing_are_told_though_all_fields_are_there(
    tmp_path: Path, text: str, problem: str
) -> None:
    (tmp_path / "a.csv").write_text(text)
    with pytest.raises(ValueError, match=problem):
        read_rows(tmp_path / "a.csv")


@given(st.one_of(st.none(), st.booleans(), st.integers(), st.floats(allow_nan=False, allow_infinity=False), st.text()))
def test_what_is_written_can_be_read_again(cell: Cell) -> None:
    text = written(cell)
    if isinstance(cell, bool):
        assert text == str(int(cell))
    elif isinstance(cell, float):
        assert float(text) == pytest.approx(cell, rel=1e-5)
    else:
        assert text == ("" if cell is None else str(cell))
