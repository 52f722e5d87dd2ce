"""The bandits as a component: what they ask of the manager, refuse, remember and repeat."""

from __future__ import annotations

from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from jsonschema import Draft202012Validator

from regraft import CallFailed, Component
from regraft.bus_schema.annotations import PlainValue
from regraft.bus_schema.messages.planning import PlannerDescription, PlannerQuery, Proposal, ProposalRequest
from regraft.bus_schema.model.adaptation import ChangeState, Connect, Outcome, SetParameters
from regraft.bus_schema.model.lifecycle import State, Transition
from regraft.client import as_json
from tests.planners.parts import SPEEDS, STATES, TOPICS, WAYS, Bench, bench
from tests.support.waiting import PATIENCE

SPEED = "navigator.max_velocity"
STRATEGIES = ("random", "epsilon_greedy", "ucb1", "ucb_tuned", "sliding_window_ucb", "thompson", "linucb")


def refused(on: Bench, **asked: Any) -> str:
    """Return why a request is refused; the planner is asked again afterwards, as proof that it lives."""
    with pytest.raises(CallFailed) as failure:
        on.propose(**asked)
    assert on.propose(apply=False).choice["outcome"] == "dry"
    return failure.value.why


# --- what is asked of the manager ---


def test_only_what_differs_is_changed_and_the_journal_tells_who_and_why() -> None:
    with bench() as on:
        only = [{**SPEEDS, "values": [0.18]}, {**WAYS, "values": ["careful"]}, {**TOPICS, "topics": ["velocity"]}]
        proposal = on.propose(options=only, who="tree", reason="too slow", context={"darkness": 0.5})
        assert proposal.changes == (SetParameters("navigator", {"max_velocity": 0.18, "planner": "careful"}),)
        (request,) = on.manager.requests
        assert request.changes == proposal.changes
        assert request.actor == "tree, by bandits"
        assert request.reason == "too slow; ucb1 for drive: not tried yet"
        assert request.context == {"darkness": 0.5}
        assert proposal.report is not None
        assert proposal.report.outcome is Outcome.APPLIED


def test_ports_and_states_are_varied_too_by_as_many_transitions_as_it_takes() -> None:
    with bench() as on:
        only = [{**TOPICS, "topics": ["slow/velocity"]}, {**STATES, "transitions": ["cleanup"]}]
        assert on.propose(options=only).changes == (
            Connect("drive", "velocity", "slow/velocity"),
            ChangeState("drive", Transition.DEACTIVATE),
            ChangeState("drive", Transition.CLEANUP),
        )
        assert on.manager.architecture.components["drive"].state is State.UNCONFIGURED
        assert on.propose(options=only).choice["outcome"] == "unchanged"


def test_a_choice_is_worked_out_again_if_somebody_else_was_faster() -> None:
    with bench() as on:
        only = [{**SPEEDS, "values": [0.1]}, {**STATES, "transitions": ["deactivate"]}]
        on.manager.fates = ["overtaken"]
        proposal = on.propose(options=only)
        assert proposal.choice["outcome"] == "applied"
        assert proposal.changes == (SetParameters("navigator", {"max_velocity": 0.1}),)
        assert len(on.manager.requests) == 2


def test_a_manager_that_does_not_answer_is_waited_for_within_bounds() -> None:
    with bench(adapt_within=2.0) as on:
        on.manager.fates = ["silent"]
        proposal = on.propose()
        assert (proposal.choice["outcome"], proposal.ticket, proposal.report) == ("no_answer", "", None)
        assert on.rig.clock.now() < 3e9
        assert "adaptation_manager/adapt" in proposal.choice["notes"][0]


def test_a_manager_that_refuses_is_not_held_against_the_option() -> None:
    with bench() as on:
        on.manager.fates = ["refused"]
        proposal = on.propose()
        assert (proposal.choice["outcome"], proposal.ticket) == ("refused", "")
        assert "the queue is full" in proposal.choice["notes"][0]
        assert on.propose().choice["option"] == proposal.choice["option"]


def test_a_manager_that_cannot_show_the_architecture_is_said() -> None:
    with bench() as on:
        on.manager.fates = ["blind"]
        with pytest.raises(CallFailed, match=r"cannot be asked.*the journal cannot be read"):
            on.propose()


class Hasty(Component):
    """Asks for several proposals at once."""

    def on_activate(self) -> None:
        """Ask."""
        self.found: dict[str, Proposal] = {}
        for name, task in (("first", "drive"), ("second", "drive"), ("other", "dive")):
            self.kit.spawn(self.ask(name, task))

    async def ask(self, name: str, task: str) -> None:
        """Ask once."""
        request = ProposalRequest(task, inputs={"strategy": "ucb1", "options": [SPEEDS]})
        self.found[name] = await self.kit.call("planners/bandits/propose", request, Proposal, timeout=PATIENCE)


def test_proposals_for_one_task_are_made_one_after_another() -> None:
    with bench() as on:
        on.manager.takes = 1.0
        found = on.rig.add(Hasty).found
        on.rig.advance(5.0)
        chosen = {name: proposal.choice["option"][SPEED] for name, proposal in found.items()}
        assert chosen == {"first": 0.1, "second": 0.18, "other": 0.1}
        assert found["second"].choice["applied"] >= found["first"].choice["applied"] + 1.0


# --- options that cannot be applied ---


def test_a_rejected_option_rests_for_some_proposals_longer_each_time() -> None:
    with bench(rest=2) as on:
        on.manager.fates = [Outcome.REJECTED]
        assert on.propose().choice["rests"] == 2
        others = [on.propose().choice for _ in range(2)]
        assert [choice["option"][SPEED] for choice in others] == [0.18, 0.26]
        assert [choice["resting"] for choice in others] == [1, 1]
        on.manager.fates = [Outcome.ROLLED_BACK]
        again = on.propose().choice
        assert (again["option"][SPEED], again["rests"]) == (0.1, 4)


def test_where_every_option_rests_none_does() -> None:
    with bench() as on:
        on.manager.fates = [Outcome.REJECTED] * 3
        both = [{**SPEEDS, "values": [0.1, 0.18]}]
        choices = [on.propose(options=both).choice for _ in range(4)]
        assert [choice["option"][SPEED] for choice in choices] == [0.1, 0.18, 0.1, 0.1]
        assert [choice["outcome"] for choice in choices] == ["rejected", "rejected", "rejected", "applied"]


# --- refusals ---


@pytest.mark.parametrize(
    ("asked", "said"),
    [
        ({"task": ""}, "task: is empty"),
        ({"strategy": "ucb2"}, "inputs.strategy: there is no strategy 'ucb2'; did you mean 'ucb1'?"),
        ({"knobs": {"epsilon": 0.1}}, "inputs.knobs: has no field 'epsilon'; Ucb1Knobs has: exploration, high, low"),
        ({"knobs": {"exploration": -1}}, "inputs.knobs.exploration: is -1.0, must be at least 0.0"),
        ({"knobs": {"low": 2.0}}, "inputs.knobs.high: is 1, must be greater than 'low', which is 2"),
        ({"strategy": "sliding_window_ucb", "knobs": {"window": 3}}, "inputs.knobs.window: is 3, must be more than"),
        ({"strategy": "linucb", "knobs": {"features": ["dark"]}}, "the context has no number 'dark'"),
        ({"strategy": "linucb", "knobs": {"computed": {"near": "1 +"}}}, "inputs.knobs.computed.near: "),
        ({"strategy": "linucb", "knobs": {"computed": {"far": "1e7"}}}, "the context's 'far' is 1e+07, must be within"),
        ({"strategy": "linucb", "knobs": {"computed": dict.fromkeys(map(str, range(33)), "1")}}, "computed: are 33"),
        ({"options": []}, "inputs.options: are 0, must be 1 to 64"),
        ({"options": [{"component": "navigator"}]}, "inputs.options.0: must have parameter and values, or port and"),
        ({"options": [{**SPEEDS, "topics": ["velocity"]}]}, "inputs.options.0: must have parameter and values, or"),
        ({"options": [{**SPEEDS, "values": [0.1, 0.1]}]}, "inputs.options.0: has 0.1 twice"),
        ({"options": [SPEEDS, SPEEDS]}, "inputs.options.1: varies navigator.max_velocity again"),
        ({"options": [SPEEDS, {**WAYS, "name": SPEED}]}, "inputs.options.1.name: there is another"),
        ({"options": [{**SPEEDS, "component": "navigater"}]}, "no component 'navigater'; did you mean 'navigator'?"),
        ({"options": [{**SPEEDS, "parameter": "speed"}]}, "0.parameter: navigator has no parameter 'speed'"),
        ({"options": [{**SPEEDS, "values": [0.1, 0.5]}]}, "inputs.options.0.values: 0.5: must be at most 0.26 m/s"),
        ({"options": [{**WAYS, "parameter": "frame"}]}, "inputs.options.0.parameter: navigator.frame is read-only"),
        ({"options": [{**TOPICS, "port": "velocty"}]}, "options.0.port: drive has no port 'velocty'; did you"),
        ({"options": [{**TOPICS, "topics": ["speed"]}]}, "inputs.options.0.topics: there is no topic 'speed'"),
        ({"options": [{**STATES, "transitions": ["shutdown"]}]}, "options.0.transitions: shutdown ends a component"),
        ({"options": [{**STATES, "transitions": ["start"]}]}, "options.0.transitions.0: is 'start', must be one of"),
        ({"constraints": [{"forbid": {SPEED: [0.1, 0.18, 0.26]}}]}, "leaves no option"),
        ({"constraints": [{"forbid": {"speed": 1}}]}, "constraints.0.forbid.speed: there is no dimension 'speed'"),
        ({"settle": -1.0}, "inputs.settle: is -1.0, must be at least 0.0"),
        ({"credit": {"ticket": "1"}}, "inputs.credit: lacks 'utility'"),
        ({"credit": {"ticket": "1", "utility": 1, "from": 2, "to": 1}}, "inputs.credit.to: is 1, before 'from'"),
        ({"credit": {"ticket": "1", "utility": "good", "from": 1, "to": 1}}, "credit.utility: is 'good', must be"),
        ({"surprise": 1}, "inputs: has no field 'surprise'"),
        ({"strategy": "linucb", "context": {str(n): n for n in range(40)}}, "knobs.features: are 40, must be at most"),
    ],
)  # fmt: skip
def test_what_does_not_fit_is_refused_naming_what_is_wrong_and_what_would_be_right(
    asked: dict[str, Any], said: str
) -> None:
    with bench() as on:
        assert said in refused(on, **asked)
        assert on.manager.requests == []


def test_of_a_large_context_only_what_counts_is_kept() -> None:
    with bench() as on:
        context = {str(n): n for n in range(2000)}
        assert on.propose("ucb1", context=context).ticket
        assert on.propose("linucb", context=context, knobs={"features": ["7", "9"]}).ticket
        kept = [ticket[3] for ticket in on.planner.snapshot()["drive"]["tickets"].values()]
        assert kept == [{}, {"7": 7.0, "9": 9.0}]


def test_a_refused_request_takes_no_credit() -> None:
    with bench() as on:
        credit = on.earn(on.propose("linucb"), 0.5)
        refused(on, strategy="linucb", knobs={"features": ["x"]}, credit=credit)
        assert on.propose(credit=credit, apply=False).choice["credit"]["credited"]


plain = st.recursive(
    st.none() | st.booleans() | st.integers(-5, 5) | st.floats(-5, 5) | st.sampled_from([SPEED, "ucb1", "navigator"]),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(
        st.sampled_from(["component", "parameter", "values", "forbid", "if", "then", "compare", "ticket", SPEED]), inner
    ),
    max_leaves=8,
)  # fmt: skip


@given(
    st.dictionaries(st.sampled_from(["strategy", "options", "constraints", "knobs", "credit", "settle"]), plain),
    st.dictionaries(st.text(max_size=3), plain, max_size=3),
)
@settings(max_examples=150, deadline=None)
def test_no_request_however_odd_ends_or_breaks_the_planner(inputs: dict[str, PlainValue], context: Any) -> None:
    with bench() as on:
        usual = {"strategy": "ucb1", "options": [SPEEDS]}
        try:
            on.propose(context=context, **{**usual, **inputs})
        except CallFailed as failure:
            assert failure.why.startswith(("inputs", "context")), failure.why
        assert not [event for event in on.rig.events if event.kind == "component.fault"]


@given(st.data())
@settings(max_examples=20, deadline=None)
def test_no_infeasible_option_is_ever_proposed(data: st.DataObject) -> None:
    constraints = [
        {"if": {"drive.velocity": "slow/velocity"}, "then": {SPEED: {"<=": 0.18}, "navigator.planner": "careful"}}
    ]
    with bench() as on:
        for _ in range(8):
            fates: list[Any] = [data.draw(st.sampled_from([Outcome.APPLIED, Outcome.REJECTED, Outcome.ROLLED_BACK]))]
            on.manager.fates = fates
            strategy = data.draw(st.sampled_from(STRATEGIES))
            proposal = on.propose(strategy, options=(SPEEDS, WAYS, TOPICS), constraints=constraints)
            option = proposal.choice["option"]
            slow = option["drive.velocity"] == "slow/velocity"
            assert not slow or (option[SPEED] <= 0.18 and option["navigator.planner"] == "careful")
            if proposal.ticket:
                on.propose(credit=on.earn(proposal, data.draw(st.floats(0, 1))), apply=False)


# --- repeating and remembering ---


def journey(on: Bench, rounds: int, credit: Any = None) -> tuple[list[Any], Any]:
    """Return what was proposed in some rounds, and the last credit."""
    found = []
    for turn in range(rounds):
        strategy = STRATEGIES[turn % len(STRATEGIES)]
        given = {"credit": credit} if credit else {}
        proposal = on.propose(strategy, (SPEEDS, WAYS), settle=0.25, context={"x": turn % 3}, **given)
        found.append(proposal)
        credit = on.earn(proposal, (turn * 37 % 11) / 10) if proposal.ticket else None
    return found, credit


def test_equal_seeds_give_equal_choices_and_others_others() -> None:
    runs = []
    for seed, own in ((1, 0), (1, 0), (2, 0), (1, 5)):
        with bench(seed, seed=own) as on:
            runs.append([p.choice["option"] for p in journey(on, 30)[0]])
    assert runs[0] == runs[1]
    assert runs[0] != runs[2]
    assert runs[0] != runs[3]


def test_a_planner_that_was_restarted_goes_on_as_if_it_had_not_been() -> None:
    with bench(3) as on:
        whole, _ = journey(on, 25)
    with bench(3) as on:
        begun, credit = journey(on, 11)
        state, now, architecture = on.planner.snapshot(), on.rig.clock.now(), on.manager.architecture
    with bench(3, state) as on:
        on.rig.advance(now / 1e9)
        on.manager.architecture = architecture
        goes_on = []
        for turn in range(11, 25):
            given = {"credit": credit} if credit else {}
            proposal = on.propose(STRATEGIES[turn % 7], (SPEEDS, WAYS), settle=0.25, context={"x": turn % 3}, **given)
            goes_on.append(proposal)
            credit = on.earn(proposal, (turn * 37 % 11) / 10)
    assert [p.choice for p in (*begun, *goes_on)] == [p.choice for p in whole]


def test_tasks_are_kept_apart_and_the_longest_silent_one_is_forgotten_with_an_event() -> None:
    with bench() as on:
        for index in range(257):
            on.propose(task=f"t{index}", options=({**SPEEDS, "values": [0.26]},))
        assert len(on.planner.snapshot()) == 256
        assert [event.text for event in on.rig.events if event.kind == "planner.forgot"] == [
            "task 't0' was forgotten: there are more than 256"
        ]


def test_the_planner_describes_itself_and_its_schema_accepts_what_it_accepts() -> None:
    with bench() as on:
        said = on.rig.call("planners/bandits/describe", PlannerQuery(), PlannerDescription)
        assert (said.planner, said.component) == ("bandits", "bandits")
        assert tuple(strategy.name for strategy in said.strategies) == STRATEGIES
        for strategy in said.strategies:
            Draft202012Validator.check_schema(strategy.knobs)
            defaults = {name: field["default"] for name, field in strategy.knobs["properties"].items()}
            Draft202012Validator(strategy.knobs).validate(defaults)
            assert on.propose(strategy.name, knobs=defaults, apply=False).choice["strategy"] == strategy.name
        judge = Draft202012Validator(as_json(said)["inputs"])
        good: dict[str, Any] = {
            "strategy": "ucb1",
            "options": [SPEEDS, TOPICS, STATES],
            "constraints": [
                {"forbid": {SPEED: {"<": 0.15}}, "because": "of the wind"},
                {"compare": [SPEED, "<", 0.3]},
                {"if": {"drive.velocity": ["velocity"]}, "then": {"drive.transition": "activate"}},
            ],
            "knobs": {"exploration": 0.5},
            "settle": 1.0,
            "credit": {"ticket": "1-a", "utility": 0.5, "from": 1, "to": 2.0},
        }
        judge.validate(good)
        strategy = good.pop("strategy")
        assert on.propose(strategy, **good).ticket
        bad: list[dict[str, Any]] = [{"strategy": "magic"}, {"options": []}, {"constraints": [{"if": {"a": 1}}]}]
        for wrong in (*bad, {"credit": {}}):
            assert not judge.is_valid({"strategy": "ucb1", "options": [SPEEDS], **wrong})
