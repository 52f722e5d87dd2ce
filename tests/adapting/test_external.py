"""External strategies: what is asked of a planner, and what its choices are credited with."""

from __future__ import annotations

from typing import Any

import pytest

from behavior_tree import Input, LoadError
from regraft import CallFailed
from regraft.bus_schema.messages.planning import Proposal, ProposalRequest
from regraft.bus_schema.messages.protocol.requests import Answer
from regraft.bus_schema.messages.quality import Quality
from regraft.bus_schema.model.adaptation import Outcome, SetParameters
from regraft.bus_schema.model.robots.scoped_changes import Names
from regraft.services.bt_executor.adaptation import AdaptPeriodically
from tests.adapting.helpers import Bench, FakeContext, bench

UCB = (
    'adaptation_strategy="ucb1" adaptation_subject="max_velocity" subject_location="navigator" '
    'adaptation_options="0.10;0.18;0.26" outcome="{o}" reason="{r}"'
)
EVERY_3_S = f'{UCB} adaptation_period="3s" utility="speed / 2"'


class Chooser:
    """A planner that gives tickets; ``fates`` says how what it chooses ends, then all is applied."""

    def __init__(self, *fates: str, measured: bool = True) -> None:
        self.fates = list(fates)
        self.asked: list[ProposalRequest] = []
        self.measured = measured

    def pop(self, _: int) -> Any:
        fate = self.fates.pop(0) if self.fates else "applied"
        if fate == "refused":
            return CallFailed("planners/bandits/propose", Answer.REFUSED, "there is no strategy 'ucb7'")
        number = len(self.context.proposed)
        choice: dict[str, Any] = {"outcome": fate, "why": "not tried yet", "notes": [f"it was {fate}"]}
        good = fate in ("applied", "unchanged")
        if good and self.measured:
            choice["measure_from"] = self.context.clock.now() + 0.5
        change = SetParameters("navigator", {"max_velocity": 0.1})
        report = None
        if fate in {outcome.value for outcome in Outcome}:
            self.context.fates = [Outcome(fate)]
            report = self.context.carried_out_request(change)
        return Proposal("t", (change,), choice, f"ticket-{number}" if good else "", report)

    context: FakeContext


def chosen(node_type: str, ports: str, child: str = "RUNNING", *fates: str, **more: Any) -> tuple[Bench, Chooser]:
    measured = more.pop("measured", True)
    chooser = Chooser(*fates, measured=measured)
    context = FakeContext()
    context.proposals = chooser  # type: ignore[assignment]
    chooser.context = context
    return bench(node_type, ports, child, context=context, **more), chooser


def test_a_decision_and_any_inputs_are_passed_to_any_planner() -> None:
    at, _ = chosen("AdaptOnStart", 'planner="forecast" decision="speed"')
    at.tick()
    assert at.context.services == ["/planners/forecast/propose"]
    assert [request.inputs for request in at.context.proposed] == [{"decision": "speed"}]
    at, _ = chosen("AdaptOnStart", 'planner="mine" decision="speed" settle="2s" inputs=\'json:{"depth": 3, "b": [1]}\'')
    at.tick()
    assert at.context.proposed[0].inputs == {"decision": "speed", "settle": 2.0, "depth": 3, "b": [1]}
    at, _ = chosen("AdaptOnStart", f"{UCB} inputs='json:{{\"settle\": 7}}'")
    at.tick()
    assert at.context.proposed[0].inputs["settle"] == 7
    assert at.context.proposed[0].inputs["strategy"] == "ucb1"


@pytest.mark.parametrize(
    ("ports", "told"),
    [
        ('rules="n.b := 1" decision="speed"', "needs either the port rules, or the port adaptation_strategy, decision"),
        ("inputs='json:[1]'", "port 'inputs' must hold a map"),
        ("inputs='{\"a\": 1}'", "port 'inputs': write json: before"),
        ('decision="speed" adaptation_options="1;2"', "needs the port adaptation_subject, subject_location as well"),
    ],
)
def test_a_decision_that_cannot_be_passed_is_refused_at_load(ports: str, told: str) -> None:
    with pytest.raises(LoadError) as refused:
        chosen("AdaptOnStart", ports)
    assert told in str(refused.value)


def credits_of(at: Bench) -> list[Any]:
    """Return the credits that went out so far, None for a request without one."""
    return [request.inputs.get("credit") for request in at.context.proposed]


def test_a_planner_is_told_the_options_and_where_the_node_stands() -> None:
    ports = (
        'adaptation_strategy="thompson" adaptation_subject="max_velocity; port:image;lifecycle" '
        'adaptation_location="navigator;detector;lamp" planner="bandits" knobs=\'json:{"low": 0, "high": 2}\' '
        'constraints=\'[{"forbid": {"navigator.max_velocity": 0.1}}]\' settle="200ms" because="it is dark" '
        'adaptation_options="0.10; 0.18 | camera/image;corner_camera/image | activate;deactivate"'
    )
    at, _ = chosen("AdaptOnStart", ports)
    at.context.book = (Quality(0.0, "MoveSafely", "Safety", metric=0.4, satisfied=True, degree=0.9),)
    at.tick()
    (request,) = at.context.proposed
    assert request.inputs == {
        "strategy": "thompson",
        "options": [
            {"component": "navigator", "parameter": "max_velocity", "values": [0.1, 0.18]},
            {"component": "detector", "port": "image", "topics": ["camera/image", "corner_camera/image"]},
            {"component": "lamp", "transitions": ["activate", "deactivate"]},
        ],
        "knobs": {"low": 0, "high": 2},
        "constraints": [{"forbid": {"navigator.max_velocity": 0.1}}],
        "settle": 0.2,
    }
    assert (request.task, request.actor, request.reason, request.apply) == ("adapt", "adapt", "it is dark", True)
    assert request.context == {
        "node": "adapt",
        "qualities": {"MoveSafely": {"metric": 0.4, "satisfied": True, "degree": 0.9}},
    }


def test_the_tree_may_rewrite_strategy_options_and_places() -> None:
    ports = (
        'adaptation_strategy="{how}" adaptation_subject="{what}" subject_location="{who}" '
        'adaptation_options="{options}" adaptation_period="1s"'
    )
    at, _ = chosen("AdaptPeriodically", ports, how="ucb1", what="max_velocity", who="navigator", options="0.1;0.2")
    at.ticks(12)
    at.set(how="random", what="pictures", who="detector", options="1;true;many")
    at.ticks(10)
    at.node.blackboard.unset("options")
    at.set(options=[4, 5])
    at.ticks(10)
    first, second, third = (request.inputs for request in at.context.proposed)
    assert first["options"][0]["values"] == [0.1, 0.2]
    assert second["strategy"] == "random"
    assert second["options"] == [{"component": "detector", "parameter": "pictures", "values": [1, True, "many"]}]
    assert third["options"][0]["values"] == [4, 5]


def test_utility_is_credited_to_the_option_that_earned_it_after_it_took_effect() -> None:
    at, _ = chosen("AdaptPeriodically", EVERY_3_S, speed=8.0)
    at.tick()
    at.ticks(30)
    assert credits_of(at) == [None], "nothing stood yet that a strategy had chosen"
    # The first choice was made at 3.0 s; it shows its effect from 3.5 s on.
    at.ticks(4)
    at.set(speed=1.0)
    at.ticks(10)
    at.set(speed=3.0)
    at.ticks(16)
    (credit,) = credits_of(at)[1:]
    assert credit["ticket"] == "ticket-1"
    assert (credit["from"], credit["to"]) == (pytest.approx(3.5), pytest.approx(6.0))
    # 0.5 from 3.5 s to 4.4 s (or 4.5 s, when it was seen to have changed), 1.5 from then on.
    assert credit["utility"] == pytest.approx((0.5 * 1.0 + 1.5 * 1.5) / 2.5)


def test_without_a_word_of_the_planner_it_is_measured_from_settle_on() -> None:
    at, _ = chosen("AdaptPeriodically", f'{EVERY_3_S} settle="1500ms"', speed=8.0, measured=False)
    at.tick()
    at.ticks(60)
    assert credits_of(at)[1]["from"] == pytest.approx(4.5)


@pytest.mark.parametrize("fate", ["rejected", "rolled_back", "cancelled", "stuck", "no_answer"])
def test_nothing_is_credited_to_what_was_not_applied(fate: str) -> None:
    at, _ = chosen("AdaptPeriodically", EVERY_3_S, "RUNNING", "applied", fate, "unchanged", speed=2.0)
    at.tick()
    at.ticks(60)
    assert at.entry("o") == fate
    assert at.entry("r")
    at.ticks(60)
    tickets = [credit and credit["ticket"] for credit in credits_of(at)]
    assert tickets == [None, "ticket-1", None, "ticket-3"]


@pytest.mark.parametrize("speed", [None, "fast", 0.0])
def test_without_samples_there_is_no_credit(speed: Any) -> None:
    utility = 'utility="{u}"' if speed == "fast" else 'utility="1 / speed"'
    ports = f'{UCB} adaptation_period="3s" {utility}'
    at, _ = chosen("AdaptPeriodically", ports, **({} if speed is None else {"speed": speed}))
    at.tick()
    at.ticks(90)
    assert credits_of(at) == [None, None, None]


def test_a_utility_may_be_an_entry_or_a_method() -> None:
    class Worth(AdaptPeriodically):
        speed = Input(float)

        def utility(self) -> float:
            return self.speed * 10

    ports = f'{UCB} adaptation_period="3s"'
    at, _ = chosen("AdaptPeriodically", f'{ports} utility="{{worth}}"', worth=0.25)
    at.tick()
    at.ticks(60)
    assert credits_of(at)[1]["utility"] == pytest.approx(0.25)
    chooser = Chooser()
    context = FakeContext(proposals=chooser)  # type: ignore[arg-type]
    chooser.context = context
    at = bench("Worth", f'{ports} speed="{{speed}}"', classes=(Worth,), context=context)
    at.tick()
    at.ticks(60)
    at.set(speed=0.5)
    at.ticks(30)
    assert credits_of(at)[1] is None
    assert credits_of(at)[2]["utility"] == pytest.approx(5.0)


def test_what_is_measured_while_the_child_rests_does_not_count() -> None:
    at, _ = chosen("AdaptOnStart", f'{UCB} utility="speed"', "RUNNING RUNNING RUNNING SUCCESS", speed=1.0)
    at.end()
    at.set(speed=3.0)
    at.context.advance(100.0)
    at.end()
    credit = credits_of(at)[1]
    assert credit is None, "the child ended before the effect could be measured"
    at.child.statuses = at.child.statuses[:1] * 10 + at.child.statuses[-1:]
    at.end()
    at.set(speed=7.0)
    at.context.advance(100.0)
    at.end()
    credit = credits_of(at)[-1]
    assert credit["utility"] == pytest.approx(3.0)
    assert credit["to"] - credit["from"] == pytest.approx(0.5, abs=0.11)


def test_a_credit_that_nobody_answered_for_is_told_again() -> None:
    at, _ = chosen("AdaptPeriodically", f'{EVERY_3_S} timeout="1s"', speed=2.0)
    at.tick()
    at.ticks(40)
    at.context.answers = False
    at.ticks(35)
    at.context.answers = True
    at.ticks(30)
    sent = credits_of(at)
    assert sent[1]["ticket"] == "ticket-1"
    assert sent[2] == sent[1], "and nothing was measured while it was not known which option stands"


def test_a_refusal_is_told_and_ends_as_a_rejection() -> None:
    at, _ = chosen("AdaptOnStart", f'{UCB} on_rejected="fail"', "SUCCESS", "refused")
    assert at.tick() == "FAILURE"
    assert at.entry("o") == "rejected"
    assert "no strategy 'ucb7'" in at.entry("r")


def test_a_planner_is_asked_only_if_the_condition_holds() -> None:
    at, _ = chosen("AdaptPeriodically", f'{EVERY_3_S} condition="near"')
    at.ticks(70)
    assert at.context.proposed == []
    at.set(near=True)
    at.ticks(30)
    assert len(at.context.proposed) == 1


def test_a_running_one_gives_each_choice_time_to_settle() -> None:
    at, _ = chosen("AdaptOnRunning", f'{UCB} settle="2s" utility="speed"', speed=1.0)
    at.ticks(61)
    assert len(at.context.proposed) == 4
    assert credits_of(at)[1]["ticket"] == "ticket-1"


@pytest.mark.parametrize(
    ("old", "new", "complaint"),
    [
        ('adaptation_subject="max_velocity"', "", "needs the port adaptation_subject as well"),
        ('subject_location="navigator"', "", "needs the port subject_location as well"),
        ('subject_location="navigator"', 'subject_location="a;b"', "names 2 components, adaptation_subject 1 things"),
        (
            '"max_velocity"',
            '"max_velocity;pictures"',
            "has 1 lists, adaptation_subject 2 names (max_velocity;pic",
        ),
        ('"0.10;0.18;0.26"', '"0.1 | 0.2"', "has 2 lists, adaptation_subject 1 names"),
        ('"0.10;0.18;0.26"', '""', "has no option for 'max_velocity'"),
        ("outcome=", "knobs='json:[1]' outcome=", "port 'knobs' must hold a map, as in json:{...}"),
        ("outcome=", "knobs='{\"low\": 1}' outcome=", "port 'knobs': write json: before"),
        ("outcome=", "constraints='{\"if\": 1}' outcome=", "port 'constraints'"),
        ("outcome=", "utility='1 +' outcome=", "expected a value"),
        ("outcome=", "settle='-1' outcome=", "port 'settle': '-1' is no duration"),
    ],
)
def test_what_cannot_work_is_refused_at_load(old: str, new: str, complaint: str) -> None:
    with pytest.raises(LoadError) as refused:
        bench("AdaptOnStart", UCB.replace(old, new))
    assert complaint in str(refused.value)
    assert refused.value.line == 2


def test_the_planner_is_told_of_the_entries_that_the_port_context_names_as_far_as_they_are_known() -> None:
    ports = f'{UCB} adaptation_period="3s" utility="speed" context="near; light;heading"'
    at, _ = chosen("AdaptPeriodically", ports, near=0.4, heading="north", speed=0.1)
    at.ticks(40)
    (request, *_) = at.context.proposed
    assert {name: request.context.get(name) for name in ("near", "light", "heading")} == {
        "near": 0.4,
        "light": None,
        "heading": "north",
    }
    assert "light" not in request.context


def test_a_mission_of_one_robot_among_several_names_its_own_components_and_planner() -> None:
    chooser = Chooser()
    context = chooser.context = FakeContext(names=Names("rescuer"))
    context.proposals = chooser  # type: ignore[assignment]
    ports = (
        'adaptation_strategy="ucb1" adaptation_subject="max_velocity;port:image" '
        'subject_location="navigator;/detector" adaptation_options="0.1;0.2 | camera/image;/corner/image" planner="{0}"'
    )
    bench("AdaptOnStart", ports.format("bandits"), context=context).tick()
    bench("AdaptOnStart", ports.format("/bandits"), context=context).tick()
    first, second = context.proposed
    assert context.services == ["/rescuer/planners/bandits/propose", "/planners/bandits/propose"]
    assert (
        first.inputs["options"]
        == second.inputs["options"]
        == [
            {
                "component": "rescuer.navigator",
                "parameter": "max_velocity",
                "values": [0.1, 0.2],
                "name": "navigator.max_velocity",
            },
            {
                "component": "detector",
                "port": "image",
                "topics": ["rescuer/camera/image", "corner/image"],
                "name": "/detector.image",
            },
        ]
    )


class Options:
    """Proposals that differ in what they choose."""

    def __init__(self, *options: dict[str, Any] | None, outcome: str = "applied") -> None:
        self.options = list(options)
        self.outcome = outcome

    def pop(self, _: int) -> Proposal:
        option = self.options.pop(0)
        choice: dict[str, Any] = {"outcome": self.outcome, "option": option, "why": f"number {len(self.options)}"}
        return Proposal("t", (), choice, "")


CHOSEN = 'choice="{c}" option="{m}" why="{w}"'


@pytest.mark.parametrize("outcome", ["applied", "unchanged", "rejected"])
def test_the_tree_can_read_which_option_was_chosen(outcome: str) -> None:
    context = FakeContext()
    first, second = {"n.speed": 0.18}, {"n.speed": 1, "d.image": "camera/image", "lamp.on": True}
    context.proposals = Options(first, second, None, outcome=outcome)  # type: ignore[assignment]
    ports = f'{EVERY_3_S} {CHOSEN} settle="0s" retry_after="0s"'
    at = bench("AdaptPeriodically", ports, context=context)
    seen = []
    for _ in range(3):
        at.ticks(31)
        seen.append((at.entry("c"), at.entry("m"), at.entry("w")))
    assert seen == [
        ("0.18", first, "number 2"),
        ("1 | camera/image | true", second, "number 1"),
        ("", {}, "number 0"),
    ]


def test_a_script_may_compare_the_choice_with_a_number() -> None:
    context = FakeContext()
    context.proposals = Options({"n.speed": 0.18})  # type: ignore[assignment]
    at = bench("AdaptOnStart", f'{UCB} {CHOSEN} _onSuccess="fast := c &gt; 0.15"', "SUCCESS", context=context)
    assert at.end()[-1] == "SUCCESS"
    assert at.entry("fast") == 1.0
