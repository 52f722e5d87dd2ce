"""A benchmark that reports 0 must be able to report more."""

from __future__ import annotations

from benchmarks.adapting.rewire import Faults, _runs
from benchmarks.sides.counting import Heard


def test_what_comes_twice_and_what_comes_late_are_told_apart() -> None:
    faults = Faults()
    faults.check_order([1, 2, 2, 5, 4, 6])
    assert (faults.doubled, faults.disordered) == (1, 1)


def test_contiguous_numbers_have_no_faults() -> None:
    faults = Faults()
    faults.check_order(range(10, 20))
    assert faults == Faults()


def test_what_is_heard_between_two_moves_is_a_run_of_its_own() -> None:
    heard = Heard(("a", "a", "b", "a"), (1, 3, 7, 9))
    assert _runs(heard) == [[1, 3], [7], [9]]
