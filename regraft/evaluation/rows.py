"""One line of CSV for every simulated second: what a study writes down of a run."""

from __future__ import annotations

import csv
import io
import math
import os
from abc import abstractmethod
from collections.abc import Mapping, Sequence
from itertools import pairwise
from pathlib import Path

from regraft import Component, Parameter, every
from regraft.bus_schema.model.description import Resources

Cell = str | int | float | bool | None
"""The value of a field; None is an empty one."""
DIGITS = 6
"""Significant digits of a number."""
PERIOD = 1.0
"""Simulated seconds from one row to the next."""
TIME = "time"
OVER = "over"
"""The last column of a recorder that may end before the run does: 1 in its last row."""


class RowRecorder(Component):
    """Writes down one row of simulated quantities every simulated second; a study defines them in a subclass.

    It wakes once a second and disturbs nobody. The rows depend on the run's seed alone: equal runs have
    equal files, byte for byte. A recorder that died cannot continue: what came
    meanwhile would be missing. So the file must not be there when it begins.

    One that ``may_end`` before the run does sets ``is_over`` while it makes its last row; a campaign then ends the run.
    """

    may_end = False

    resources = Resources(cpu=0.02, memory=25.0)
    handler_timeout = 2.0

    file = Parameter("", "the CSV file that is written", unit="path", read_only=True)

    @abstractmethod
    def row(self, now: float) -> Mapping[str, Cell]:
        """Return what is so at ``now`` (s), by column; always the same columns, in the same order."""

    def on_configure(self) -> None:
        """Begin without columns."""
        self.is_over = False
        self._columns: tuple[str, ...] = ()

    def on_activate(self) -> None:
        """Create the file; raises FileExistsError."""
        Path(self.file).touch(exist_ok=False)

    @every(hz=1.0 / PERIOD)
    def record(self) -> None:
        """Write one row, unless the last is written."""
        if self.is_over:
            return
        now = self.kit.now()
        row = {TIME: now, **self.row(now)}
        if self.may_end:
            row[OVER] = self.is_over
        # A line goes to the disk at once and as a whole: who looks on sees how far the run is.
        with Path(self.file).open("a", newline="") as file:
            writer = csv.writer(file, lineterminator="\n")
            if not self._columns:
                self._columns = tuple(row)
                writer.writerow(self._columns)
            writer.writerow(written(row[column]) for column in self._columns)


def written(cell: Cell) -> str:
    """Return a cell as it is written: true and false as 1 and 0, a number with six significant digits.

    >>> written(True), written(0.1 + 0.2), written(3), written(None), written("camera/image")
    ('1', '0.3', '3', '', 'camera/image')
    """
    if cell is None:
        return ""
    if isinstance(cell, bool):
        return str(int(cell))
    return f"{cell:.{DIGITS}g}" if isinstance(cell, float) else str(cell)


class Rows:
    """A run's rows, read back: columns by name."""

    def __init__(self, columns: Mapping[str, list[str]]) -> None:
        self._columns = dict(columns)

    def __len__(self) -> int:
        """Return the number of rows."""
        return len(next(iter(self._columns.values()), []))

    def names(self) -> tuple[str, ...]:
        """Return the names of the columns, in their order."""
        return tuple(self._columns)

    @property
    def are_over(self) -> bool:
        """Whether the recorder wrote its last row before the run's end."""
        return self._columns.get(OVER, [""])[-1:] == ["1"]

    def text(self, name: str) -> list[str]:
        """Return a column as it is written; raises KeyError."""
        return self._columns[name]

    def number(self, name: str) -> list[float]:
        """Return a column of numbers, NaN where it is empty; raises KeyError, ValueError."""
        return [float(cell) if cell else float("nan") for cell in self._columns[name]]

    def is_so(self, name: str) -> list[bool]:
        """Return a column of ones and zeros; an empty field is no."""
        return [cell == "1" for cell in self._columns[name]]


def ends_with_last_row(path: Path) -> bool:
    """Return whether a recorder that may end before its run has written its last row; raises OSError."""
    with path.open("rb") as file:
        if not file.readline().rstrip().endswith(f",{OVER}".encode()):
            return False
        file.seek(-min(3, path.stat().st_size), os.SEEK_END)
        return file.read() == b",1\n"


def read_rows(path: Path) -> Rows:
    """Return what a recorder has written.

    A row that was written in part may have all fields. The rest of its time stands before the next row, or its last
    field is shorter. Times and the end of the last line reveal that.

    Raises:
        ValueError: a line has no end, or another number of fields than the first. Or its time is not a second after
            that of the line before. The text names the line.
    """
    with path.open(newline="") as file:
        text = file.read()
    lines = list(csv.reader(io.StringIO(text, newline="")))
    header, body = (lines[0], lines[1:]) if lines else ([], [])
    for number, line in enumerate(body, start=2):
        if len(line) != len(header):
            raise ValueError(f"{path}, line {number}: has {len(line)} fields, must have {len(header)}")
    if text and not text.endswith("\n"):
        raise ValueError(f"{path}, line {len(lines)}: has no end")
    rows = Rows({name: [line[index] for line in body] for index, name in enumerate(header)})
    if TIME in header:
        _check_times(path, rows.text(TIME))
    return rows


def _check_times(path: Path, times: Sequence[str]) -> None:
    for number, (before, now) in enumerate(pairwise(times), start=3):
        if not PERIOD / 2 < _seconds(now) - _seconds(before) < 1.5 * PERIOD:  # a phase of its own is rounded
            raise ValueError(f"{path}, line {number}: its time {now!r} is not a second after {before!r}")


def _seconds(time: str) -> float:
    try:
        return float(time)
    except ValueError:
        return math.nan
