"""Ports that make no sense while the mission runs: the adaptation is rejected, and the mission continues."""

from __future__ import annotations

from typing import Any

import pytest

from tests.adapting.helpers import Bench, bench
from tests.adapting.test_external import UCB, chosen

RULES = 'subject_location="navigator" outcome="{o}" reason="{r}" '
SPEED = f'{RULES} rules="max_velocity := 0.1"'
OPTIONS = UCB.replace('"0.10;0.18;0.26"', '"{bad}"')


def made(node_type: str, ports: str, bad: Any) -> Bench:
    if "ucb1" in ports:
        return chosen(node_type, ports, bad=bad)[0]
    return bench(node_type, ports, bad=bad)


BAD: list[tuple[str, str, Any, str]] = [
    ("AdaptPeriodically", f'{SPEED} adaptation_period="{{bad}}"', "banana", "'banana' is no duration"),
    ("AdaptPeriodically", f'{SPEED} adaptation_period="{{bad}}"', 0.001, "must be at least 0.01 s"),
    ("AdaptPeriodically", f'{SPEED} adaptation_period="{{bad}}"', -3, "must be a number of seconds, 0 or more"),
    ("AdaptPeriodically", f'{SPEED} adaptation_period="{{missing}}"', 0, "entry 'missing'"),
    ("AdaptOnStart", f'{RULES} rules="{{bad}}"', "x + 1", "is no action"),
    ("AdaptOnStart", f'{RULES} rules="bad &gt; 0.5 : max_velocity := 0.1"', "dark", "where a number is needed"),
    ("AdaptOnStart", f'{RULES} rules="bad &amp;&amp; 1 : max_velocity := 0.1"', 5, "neither true nor false"),
    ("AdaptOnStart", f'{RULES} rules="max_velocity += bad"', "fast", "is not a number"),
    ("AdaptOnStart", f'{SPEED} timeout="{{bad}}"', "soon", "port 'timeout': 'soon' is no duration"),
    ("AdaptOnStart", f'{SPEED} retry_after="{{bad}}"', "soon", "port 'retry_after'"),
    ("AdaptOnStart", f'{SPEED} on_stuck="{{bad}}"', "weep", "port 'on_stuck': 'weep' is no policy"),
    ("AdaptOnRunning", f'{SPEED} confirm="1s" watch="{{bad}}"', "[1", "port 'watch'"),
    ("AdaptOnStart", OPTIONS, "", "has no option"),
    ("AdaptOnStart", OPTIONS, 3, "adaptation_options is 3"),
    ("AdaptOnStart", f'{UCB} knobs="{{bad}}"', "a", "port 'knobs'"),
    ("AdaptOnStart", f'{UCB} settle="{{bad}}"', "never", "port 'settle'"),
    ("AdaptOnStart", f'{UCB} condition="{{bad}}"', "1 +", "expected a value"),
    ("AdaptOnStart", f'{UCB} condition="bad"', "yes", "neither true nor false"),
]


@pytest.mark.parametrize(("node_type", "ports", "bad", "reason"), BAD)
def test_a_value_that_makes_no_sense_rejects_the_adaptation_and_states_why(
    node_type: str, ports: str, bad: Any, reason: str
) -> None:
    at = made(node_type, ports, bad)
    assert at.ticks(3) == ["RUNNING"] * 3
    assert at.entry("o") == "rejected"
    assert reason in at.entry("r")
    assert at.context.adaptations == []
    assert at.context.proposed == []
    assert at.child.ticks == 3
    at.tree.halt_tree()
    assert at.idle


@pytest.mark.parametrize(("node_type", "ports", "bad", "reason"), BAD)
def test_the_policy_for_rejections_holds_for_such_values_too(node_type: str, ports: str, bad: Any, reason: str) -> None:
    at = made(node_type, f'{ports} on_rejected="fail"', bad)
    assert at.end()[-1] == "FAILURE"
    assert at.child.halts == at.child.starts
    assert at.idle


def test_it_adapts_again_once_the_value_makes_sense() -> None:
    ports = f'{SPEED} adaptation_period="{{bad}}" retry_after="2s"'
    at = bench("AdaptPeriodically", ports, bad="banana")
    at.ticks(15)
    assert at.entry("o") == "rejected"
    assert at.context.adaptations == []
    at.set(bad="500ms")
    at.ticks(6)
    assert at.context.asked_for == [{"max_velocity": 0.1}]
    assert at.entry("o") == "applied"


def test_a_rejection_without_a_readable_policy_is_ignored() -> None:
    at = bench("AdaptOnStart", f'{SPEED} on_rejected="{{bad}}"', bad="weep")
    assert at.ticks(2) == ["RUNNING", "RUNNING"]
    assert at.entry("o") == "rejected"
    assert "port 'on_rejected': 'weep' is no policy" in at.entry("r")


def test_a_utility_that_makes_no_sense_is_measured_as_nothing_and_rejects_the_next_choice() -> None:
    at, chooser = chosen("AdaptPeriodically", f'{UCB} adaptation_period="1s" utility="bad / 2"', bad=1.0)
    at.ticks(11)
    at.tree.blackboard.unset("bad")
    at.set(bad="much")
    at.ticks(11)
    assert at.entry("o") == "rejected"
    assert at.entry("r").startswith("utility: '/' does not work on 'much'")
    assert len(chooser.context.proposed) == 1
