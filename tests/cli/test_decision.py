"""``regraft decision`` checks decision files, compares them with a stack, and explains what would be chosen there."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from tests.cli.conftest import Regraft
from tests.support.paths import ROOT

FROG = ROOT / "regraft" / "stacks" / "frog"


def test_check_says_what_is_right_and_what_planners_cannot_express(regraft: Regraft) -> None:
    done = regraft("decision", "check", str(FROG / "decisions" / "speed.yaml"), "--stack", str(FROG / "decided.yaml"))
    assert done.exit_code == 0, done.output
    assert "1 choice, 2 entries of context: right" in done.stdout
    assert "forecast cannot express objective.settle: it measures no effect" in done.stdout


def test_check_compares_with_a_stack_by_line_and_field(regraft: Regraft, tmp_path: Path) -> None:
    text = (FROG / "decisions" / "speed.yaml").read_text()
    for right, wrong in (
        ("topic: scan", "topic: scam"),
        ("0.17, 0.26]", "0.17, 9.26]"),
        ("estimated: navigator.safety", "estimated: navigatr.safety"),
        ("navigator.power", "navigator.powr"),
    ):
        assert right in text
        text = text.replace(right, wrong)
    file = tmp_path / "speed.yaml"
    file.write_text(text)
    done = regraft("decision", "check", str(file), "--stack", str(FROG / "decided.yaml"))
    assert done.exit_code == 2
    told = done.stderr.replace(str(file), "FILE")
    assert "FILE:4: context.nearest.topic: there is no topic 'scam'; did you mean 'scan'?" in told
    assert "FILE:8: choices.max_velocity.values.2: 9.26: must be at most 0.26 m/s" in told
    assert "navigatr.safety: there is no component 'navigatr'; did you mean 'navigator'?" in told
    assert "FILE:16: qualities.economy.estimated: navigator estimates no 'powr'; did you mean 'power'?" in told


def test_show_explains_what_would_be_chosen(regraft: Regraft) -> None:
    asked_for = ("decision", "show", str(FROG / "decisions" / "speed.yaml"), "--stack", str(FROG / "decided.yaml"))
    done = regraft(*asked_for, "--context", "nearest=0.4")
    assert "chosen: max_velocity 0.17" in done.stdout
    assert "branch_and_bound: 3 combinations" in done.stdout
    plain = json.loads(regraft(*asked_for, "--context", "nearest=2", "--solver", "exhaustive", "--json").stdout)
    assert plain["option"] == {"max_velocity": 0.26}
    assert plain["proven"] is True
    wrong = regraft(*asked_for, "--solver", "cpsat")
    assert (wrong.exit_code, "did you mean 'cp_sat'" in wrong.stderr) == (2, True)


@pytest.mark.parametrize(
    ("given", "problem"),
    [
        ("neerest=1", "there is no entry of context 'neerest'; did you mean 'nearest'?"),
        ("nearest=1e400", "1e400 is too large for a number"),
        ("nearest", "must be NAME=VALUE"),
    ],
)
def test_a_context_that_cannot_be_is_refused_before_anything_is_shown(
    regraft: Regraft, given: str, problem: str
) -> None:
    file = str(FROG / "decisions" / "speed.yaml")
    done = regraft("decision", "show", file, "--stack", "frog/decided.yaml", "--context", given)
    assert (done.exit_code, done.stdout) == (2, "")
    assert f"--context {given}: {problem}" in done.stderr
