"""Rule tables in XML: what they say is what is done."""

from __future__ import annotations

from contextlib import suppress
from typing import Any
from xml.sax.saxutils import quoteattr

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from behavior_tree import Input, LoadError, NodeError
from regraft.bus_schema.model.adaptation import ChangeState, Connect
from regraft.bus_schema.model.lifecycle import Transition
from regraft.services.bt_executor.adaptation import AdaptOnStart, Step
from regraft.services.bt_executor.adaptation.rules.rule_text import SetText, read_table
from tests.adapting.helpers import bench, speed_change

LISTING_1 = (
    "safety &lt; 0.09 || power > 5.0 : max_velocity -= 0.08 within [0.10, 0.26]; "
    "safety > 0.15 || power &lt; 4.0 : max_velocity += 0.08 within [0.10, 0.26]"
)


class Listing1(AdaptOnStart):
    """The paper's example of an internal plan."""

    safety = Input(float)
    power = Input(float)

    def plan(self) -> Step | None:
        if self.safety < 0.09 or self.power > 5.0:
            return Step(*self.target(), -0.08, 0.10, 0.26)
        if self.safety > 0.15 or self.power < 4.0:
            return Step(*self.target(), 0.08, 0.10, 0.26)
        return None


@pytest.mark.parametrize("written", ["as rules", "as a class"])
@pytest.mark.parametrize(
    ("safety", "power", "now", "then"),
    [
        (0.08, 4.5, 0.26, 0.18),
        (0.12, 5.1, 0.26, 0.18),
        (0.08, 3.0, 0.18, 0.10),
        (0.08, 4.5, 0.12, 0.10),
        (0.16, 4.5, 0.10, 0.18),
        (0.12, 3.9, 0.18, 0.26),
        (0.12, 3.9, 0.20, 0.26),
        (0.12, 4.5, 0.18, None),
        (0.09, 5.0, 0.18, None),
        (0.15, 4.0, 0.18, None),
        (0.08, 4.5, 0.10, None),
        (0.16, 3.0, 0.26, None),
    ],
)
def test_listing_1_of_the_paper(written: str, safety: float, power: float, now: float, then: float | None) -> None:
    ports = f'subject_location="navigator" outcome="{{o}}" rules="{LISTING_1}"'
    if written == "as a class":
        ports = 'subject_location="navigator" adaptation_subject="max_velocity" outcome="{o}" '
        ports += 'safety="{safety}" power="{power}"'
    at = bench("AdaptOnStart" if written == "as rules" else "Listing1", ports, classes=(Listing1,))
    at.set(safety=safety, power=power)
    at.context.change(speed_change(now))
    at.tick()
    assert at.context.asked_for == ([] if then is None else [{"max_velocity": then}])


@pytest.mark.parametrize(
    ("rules", "wanted"),
    [
        ("navigator.max_velocity := 0.2", {"max_velocity": 0.2}),
        ("set max_velocity = 0.2", {"max_velocity": 0.2}),
        ("max_velocity := wish / 2 within [0.1, 0.15]", {"max_velocity": 0.15}),
        ("max_velocity := near ? 0.1 : 0.2", {"max_velocity": 0.1}),
        ("!near : max_velocity := 0.2; near : max_velocity := 0.3", {"max_velocity": 0.3}),
        ("(near ? 0 : 1) : max_velocity := 0.2; true : max_velocity := 0.3", {"max_velocity": 0.3}),
        ("near ? 1 : 0 : max_velocity := 0.2", {"max_velocity": 0.2}),
        ("mode := 'a:b;c,d'", {"mode": "a:b;c,d"}),
        ("detector.pictures += 2", {"pictures": 3}),
        ("detector.pictures := 1 + 1", {"pictures": 2}),
        ("max_velocity -= 0.08, max_velocity -= 0.04", {"max_velocity": 0.14}),
    ],
)
def test_what_rules_set(rules: str, wanted: dict[str, Any]) -> None:
    at = bench("AdaptOnStart", f'subject_location="navigator" rules="{rules}"', near=1, wish=0.8)
    at.tick()
    assert at.context.asked_for == [wanted]
    (value,) = at.context.asked_for[0].values()
    assert type(value) is type(next(iter(wanted.values())))


def test_a_rule_may_connect_and_change_states_in_one_transaction() -> None:
    rules = "dark > 0.7 : connect detector.image to corner_camera/image, activate lamp, detector.pictures := 3"
    at = bench("AdaptOnStart", f'rules="{rules}"', dark=0.8)
    at.tick()
    (request,) = at.context.adaptations
    assert request.changes[:2] == (
        Connect("detector", "image", "corner_camera/image"),
        ChangeState("lamp", Transition.ACTIVATE),
    )
    assert at.context.asked_for == [{"pictures": 3}]
    assert request.reason == rules
    assert request.context == {"node": "adapt", "rule": rules}


def test_a_rule_may_disconnect_a_port() -> None:
    at = bench("AdaptOnStart", 'subject_location="detector" rules="disconnect image, disconnect lamp.level"')
    at.tick()
    (request,) = at.context.adaptations
    assert request.changes == (Connect("detector", "image", None), Connect("lamp", "level", None))


@pytest.mark.parametrize(
    "rules",
    [
        "max_velocity := 0.26",
        "max_velocity += 0.1 within [0.1, 0.26]",
        "connect detector.image to camera/image",
        "deactivate lamp",
        "configure lamp",
        "configure detector, activate detector",
        "deactivate horn, cleanup horn",
        "detector.pictures := 1, mode := 'wary'",
    ],
)
def test_a_rule_that_would_change_nothing_asks_for_nothing(rules: str) -> None:
    at = bench("AdaptOnStart", f'subject_location="navigator" outcome="{{o}}" rules="{rules}"', "SUCCESS")
    assert at.tick() == "SUCCESS"
    assert at.context.adaptations == []
    assert at.entry("o") == "unchanged"


@pytest.mark.parametrize(
    ("rules", "steps"),
    [
        ("activate horn", (ChangeState("horn", Transition.CONFIGURE), ChangeState("horn", Transition.ACTIVATE))),
        (
            "configure horn, activate horn",
            (ChangeState("horn", Transition.CONFIGURE), ChangeState("horn", Transition.ACTIVATE)),
        ),
        ("configure lamp, activate lamp", (ChangeState("lamp", Transition.ACTIVATE),)),
        (
            "cleanup detector",
            (ChangeState("detector", Transition.DEACTIVATE), ChangeState("detector", Transition.CLEANUP)),
        ),
    ],
)
def test_a_transition_leads_to_its_state_from_any_other(rules: str, steps: tuple[ChangeState, ...]) -> None:
    at = bench("AdaptOnStart", f'rules="{rules}"')
    at.tick()
    (request,) = at.context.adaptations
    assert request.changes == steps


def test_only_what_changes_is_asked_for() -> None:
    at = bench("AdaptOnStart", 'subject_location="navigator" rules="max_velocity := 0.26, mode := \'bold\'"')
    at.tick()
    assert at.context.asked_for == [{"mode": "bold"}]


def test_a_rule_without_its_data_decides_nothing_and_lets_no_later_rule_decide() -> None:
    at = bench("AdaptOnRunning", f'subject_location="navigator" rules="{LISTING_1}"', power=3.0)
    at.context.change(speed_change(0.18))
    at.ticks(3)
    assert at.context.asked == []
    at.set(safety=0.12)
    at.tick(0.1)
    assert at.context.asked_for == [{"max_velocity": 0.26}]


def test_the_tree_may_rewrite_rules_locations_and_bounds() -> None:
    ports = 'subject_location="{who}" rules="{rules}"'
    at = bench("AdaptOnRunning", ports, who="navigator", rules="max_velocity := most", most=0.2)
    at.tick()
    at.set(most=0.1)
    at.tick(0.1)
    at.set(who="detector", rules="pictures += 1 within [1, limit]", limit=2)
    at.ticks(4, 1.5)
    assert at.context.asked_for == [{"max_velocity": 0.2}, {"max_velocity": 0.1}, {"pictures": 2}]


@pytest.mark.parametrize(
    ("ports", "complaint"),
    [
        ('rules="power > > 5 : max_velocity := 1"', "rule 1, 'power > > 5 : max_velocity := 1': column"),
        ('rules="a : navigator.b := 1; c : ; "', "rule 2, 'c :': '' is no action; there are: PARAMETER := VALUE"),
        (
            'rules="a : navigator.b := 1; x = 3 : navigator.b := 2"',
            "b := 2': 'x = 3' assigns",
        ),
        ('rules=": navigator.b := 1"', "there is no condition before ':'"),
        ('rules=" ; "', "there is no rule"),
        ('rules="max_velocity := 1"', "does not name its component, and subject_location is not given"),
        (
            'rules="b := 1" subject_location="one;two"',
            "does not name its component, and subject_location is one;two",
        ),
        ('rules="activate"', "'activate' does not name its component"),
        ('rules="n.b := 1 within [1]"', "rule 1"),
        ('rules="activate a, cleanup b, deactivate a"', "a is to become two things"),
        ('rules="n.b := 1" adaptation_subject="c"', "sets 'b', but adaptation_subject is c"),
        ('rules="explode navigator"', "'explode navigator' is no action"),
        ('rules="n.b := 1" adaptation_strategy="ucb1"', "either the port rules, or the port adaptation_strategy"),
        ("", "either the port rules, or the port adaptation_strategy"),
        ('rules="n.b := 1" knobs="json:{}"', "port 'knobs' is for external strategies"),
        (
            'rules="n.b := 1" timeout="soon"',
            "port 'timeout': 'soon' is no duration; write seconds",
        ),
        ('rules="n.b := 1" on_rejected="panic"', "port 'on_rejected': 'panic' is no policy; write ignore, fail, retry"),
        ('rules="n.b := 1" watch="MoveSafely"', "port 'watch' needs the port confirm as well"),
        ('rules="n.b := 1" confirm="soon"', "port 'confirm': 'soon' is no duration"),
        (
            """rules="n.b := 1" confirm="1s" watch='json:[{"quality": "a.b"}]'""",
            "port 'watch': 0: must have bounds: at_least, at_most, within",
        ),
        ('decision="pace" confirm="1s"', "port 'confirm' is for rules and plans"),
        ('rules="n.b := 1" subject_location="a" adaptation_location="a"', "which mean the same; give one of them"),
    ],
)
def test_what_cannot_work_is_refused_at_load_with_its_line(ports: str, complaint: str) -> None:
    with pytest.raises(LoadError) as refused:
        bench("AdaptOnStart", ports)
    assert complaint in str(refused.value)
    assert refused.value.line == 2
    assert refused.value.node == "adapt"


def test_rules_written_by_the_tree_that_make_no_sense_are_rejected_and_named() -> None:
    at = bench("AdaptOnStart", 'rules="{rules}" outcome="{o}" reason="{r}"', rules="x := 1")
    assert at.tick() == "RUNNING"
    assert at.entry("o") == "rejected"
    assert at.entry("r").startswith("rule 1, 'x := 1'")
    assert not at.node.under_way.busy


PIECES = ": ; , ? ( ) [ ] ' a n.b := += -= = 1 0.5 within connect to x/y activate set < && ! - . @ { } é \\ 1e999"


@settings(max_examples=200, deadline=None)
@given(st.lists(st.sampled_from(PIECES.split()), max_size=14).map(" ".join))
def test_no_rule_table_however_odd_does_worse_than_to_be_refused(table: str) -> None:
    try:
        at = bench("AdaptOnStart", f"rules={quoteattr(table)}", "SUCCESS", a=1, n=2)
    except LoadError as refused:
        assert refused.line == 2
        return
    with suppress(NodeError):
        at.tick()
    at.tree.halt_tree()
    assert at.idle


@pytest.mark.parametrize(
    "rules", ["{}max_velocity := 1{}x", "max_velocity := 1{} within{}[1, 2", "true : {}", "connect a{}to{}"]
)
def test_a_table_of_many_blanks_is_refused_before_it_is_read(rules: str) -> None:
    with pytest.raises(ValueError, match=r"the rules have \d+ characters: at most 10000"):
        read_table(rules.replace("{}", " " * 30_000))


NAVIGATOR = 'subject_location="navigator"'


def test_rules_compare_with_statuses_by_name_and_may_call_functions() -> None:
    at = bench("AdaptOnStart", f'{NAVIGATOR} rules="max(a, 1) == SUCCESS : max_velocity := 0.1"', a=2)
    at.tick()
    assert at.context.asked_for == [{"max_velocity": 0.1}]


def test_a_sum_without_end_is_nested_too_deeply_and_a_long_one_is_not() -> None:
    with pytest.raises(LoadError, match="the script is nested too deeply"):
        bench("AdaptOnStart", f'rules="1 {"+1" * 4_000} &gt; 0 : n.b := 1"')
    at = bench("AdaptOnStart", f'{NAVIGATOR} rules="a {"+ 1 " * 200} &gt; 200 : max_velocity := 0.1"', a=1)
    at.tick()
    assert at.context.asked_for == [{"max_velocity": 0.1}]


@pytest.mark.parametrize(
    ("text", "value", "low", "high"),
    [
        ("a := 1 within [0, 2]", "1", "0", "2"),
        ("a := b * 2   within[ x ,y + 1 ]", "b * 2", "x", "y + 1"),
        ("a := 1 within [0, 2", "1 within [0, 2", "", ""),
        ("a := 1 within [0]", "1 within [0]", "", ""),
        ("a := 1within [0, 2]", "1within [0, 2]", "", ""),
        ("a := 'x within [0, 2]'", "'x within [0, 2]'", "", ""),
        ("a := within + 1 within [0, 2]", "within + 1", "0", "2"),
    ],
)
def test_bounds_are_told_from_values(text: str, value: str, low: str, high: str) -> None:
    (rule,) = read_table(text)
    assert rule.actions == (SetText("a", ":=", value, low, high),)
