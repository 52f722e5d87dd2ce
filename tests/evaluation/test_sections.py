"""What sections of reports say of runs that are there."""

from __future__ import annotations

from dataclasses import replace

from regraft.evaluation.reports.sections import Arms, Claim, comparisons_table, costs_line
from regraft.evaluation.rows import Rows
from regraft.evaluation.study import Configuration, Results, RunRecord, Timing


def _runs(key: str, values: dict[int, float]) -> list[RunRecord]:
    configuration = Configuration(key, "as it is")
    return [
        RunRecord(configuration, number, seed, 10.0, Rows({"value": [str(value)]}), (), {}, Timing(1.0, 10.0))
        for number, (seed, value) in enumerate(values.items(), start=1)
    ]


def test_a_claim_is_judged_over_all_runs_and_room_by_room() -> None:
    rooms = range(1, 11)
    good, bad = {n: float(n * n) for n in rooms}, {n: n * n - 1.0 if n < 10 else 100.0 for n in rooms}
    arms = Arms({"good": _runs("good", good), "bad": _runs("bad", bad)})
    claim = Claim("value", "good", "bad")
    text = comparisons_table(arms, [claim], {"value": lambda rows: rows.number("value")[0]}, 0.05)
    assert "| good > bad |" in text
    assert "9 of 10, 1 equal" in text


def test_fewer_than_ten_runs_are_not_compared() -> None:
    arms = Arms({"good": _runs("good", {1: 2.0, 2: 9.0, 3: 4.0}), "bad": _runs("bad", {1: 1.0, 2: 8.0, 3: 4.0})})
    claim = Claim("value", "good", "bad")
    text = comparisons_table(arms, [claim], {"value": lambda rows: rows.number("value")[0]}, 0.05)
    assert text == "No two configurations have 10 runs each: nothing is compared.\n"


def test_the_speed_of_runs_is_that_of_the_time_which_passed_in_them() -> None:
    (whole,) = _runs("one", {1: 1.0})
    ended = replace(whole, closing={"simulated_s": 5.0}, timing=Timing(1.0, 5.0))
    line = costs_line(Results("", [ended], [], 1, ""))
    assert "runs went 1.0 times as fast as real time" in line
