"""A schedule that is wrong is refused before anything runs: by file, line and field, or by what was typed."""

from __future__ import annotations

from pathlib import Path

import pytest

from regraft.stack import StackError, load, with_faults
from tests.faults.stacks import STACK, UNDER_THE_REAL_CLOCK, write


@pytest.mark.parametrize(
    ("entry", "field", "problem"),
    [
        ("{at: 1, component: drivr, kind: kill}", "component", "did you mean 'driver'?"),
        ("{at: 1, component: driver, kind: kil}", "kind", "did you mean 'kill'?"),
        ("{at: 1, component: driver, knd: kill}", "knd", "did you mean 'kind'?"),
        ("{at: 1, component: driver}", "kind", "is missing"),
        ("{component: driver, kind: kill}", "at", "is missing"),
        ("{at: -1, component: driver, kind: kill}", "at", "must be at least 0"),
        ("{at: soon, component: driver, kind: kill}", "at", "must be a number"),
        ("{at: .nan, component: driver, kind: kill}", "at", "must be finite"),
        ("{at: 1, component: world, kind: kill}", "component", "makes simulated time continue"),
        ("{at: 1, component: driver, kind: kill, delay: 1}", "delay", "is for 'slow'"),
        ("{at: 1, component: driver, kind: slow, back_after: 1}", "back_after", "leave it out"),
        ("kill", "", "must be a map"),
    ],
)
def test_an_entry_that_is_wrong_is_named_by_line_and_field(
    tmp_path: Path, entry: str, field: str, problem: str
) -> None:
    file = write(tmp_path, STACK, f"  - {{at: 0.5, component: spare, kind: exception}}\n  - {entry}\n")
    line = len(STACK.splitlines()) + 3
    with pytest.raises(StackError) as caught:
        load(file)
    place = f"{file}:{line}: faults.1" + (f".{field}" if field else "")
    assert any(str(found).startswith(place) and problem in found.problem for found in caught.value.problems)


def test_two_faults_of_a_component_that_is_gone_by_then_are_refused(tmp_path: Path) -> None:
    first, second = "{at: 1, component: driver, kind: kill, back_after: 2}", "{at: 2.5, component: driver, kind: hang}"
    with pytest.raises(StackError, match="'driver' is gone from 1 s to 3 s"):
        load(write(tmp_path, STACK, f"  - {first}\n  - {second}\n"))


def test_an_absence_in_simulated_time_is_refused_under_the_real_clock(tmp_path: Path) -> None:
    entry = "  - {at: 1, component: driver, kind: kill, back_after: 2}\n"
    with pytest.raises(StackError, match="'restart' rules under the real clock"):
        load(write(tmp_path, UNDER_THE_REAL_CLOCK, entry))


@pytest.mark.parametrize(
    ("typed", "problem"),
    [
        ("driver kill", "must look like 'SECONDS COMPONENT KIND'"),
        ("1 driver kill 2", "must look like 'SECONDS COMPONENT KIND'"),
        ("1 driver slow much", "must be a number"),
        ("1e999 driver kill", "too large"),
        ("1 drivr kill", "did you mean 'driver'?"),
        ("1 driver explode", "there is no kind 'explode' of fault"),
        ("", "must look like"),
    ],
)
def test_a_typed_fault_that_is_wrong_is_quoted(tmp_path: Path, typed: str, problem: str) -> None:
    with pytest.raises(StackError) as caught:
        with_faults(load(write(tmp_path)), [typed, "1 driver exception"])
    (found,) = caught.value.problems
    assert found.file == f"fault {typed!r}"
    assert problem in found.problem


@pytest.mark.parametrize(
    ("topics", "connect", "problem"),
    [
        ("  system/mine: {type: faults/Sample}\n", "", "the system itself has the topics that begin with 'system/'"),
        ("", ", connect: {commands: system/faults}", "components only read it"),
        ("", ", connect: {position: system/fault}", "did you mean 'system/faults'?"),
        ("", ", connect: {position: system/faults}", "takes faults/Sample, but topic 'system/faults' carries"),
    ],
)
def test_the_topics_of_the_system_are_its_own(tmp_path: Path, topics: str, connect: str, problem: str) -> None:
    text = STACK.replace("components:\n", f"{topics}components:\n", 1)
    text = text.replace("Driver', state: inactive}", f"Driver', state: inactive{connect}}}")
    with pytest.raises(StackError, match=problem.replace("?", r"\?")):
        load(write(tmp_path, text))
