"""Choosing what should be: slots of one or several alternatives, objectives over them, and why something was chosen."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest

from regraft import Component, Output, Parameter, Quality
from regraft.adaptation_manager.planners.choices.choosing import Choice, choose, standing
from regraft.adaptation_manager.planners.choices.decomposition import summands
from regraft.adaptation_manager.planners.choices.estimates import ClassEstimates
from regraft.adaptation_manager.planners.choices.fitting import misfits
from regraft.adaptation_manager.planners.choices.in_architecture import changes_for
from regraft.adaptation_manager.planners.choices.objective import Evaluation, Objective
from regraft.adaptation_manager.planners.choices.rules.rulebook import Rulebook
from regraft.adaptation_manager.planners.choices.settings import Kind, Setting
from regraft.adaptation_manager.planners.choices.slots import Alternative, Slot, varied
from regraft.adaptation_manager.planners.choices.solvers.branch_and_bound import BranchAndBound
from regraft.adaptation_manager.planners.choices.solvers.exhaustive import Exhaustive
from regraft.bus_schema.annotations import PlainValue
from regraft.bus_schema.errors import BadMessage
from regraft.bus_schema.messages.geometry import Twist
from regraft.bus_schema.model.adaptation import Add, ChangeState, Connect, Move, Remove, SetParameters, Swap
from regraft.bus_schema.model.architecture import Architecture
from regraft.bus_schema.model.expressions import Expression
from regraft.bus_schema.model.lifecycle import Transition
from regraft.component.component import class_path
from tests.planners.parts import robot, spec


class Wheels(Component):
    """Expects to drive as fast as it may, at a cost."""

    velocity = Output(Twist)
    max_velocity = Parameter(0.26, minimum=0.0, maximum=1.0, unit="m/s")
    odd = Parameter("", "a quality that is no number is claimed with it")

    speed = Quality(unit="m/s", better="higher", measured=False)
    power = Quality(unit="W", better="lower", measured=False)
    slope = Quality(measured=False, better="lower")

    @classmethod
    def estimate(cls, parameters: dict[str, PlainValue], context: dict[str, PlainValue]) -> dict[str, float]:
        speed = float(parameters["max_velocity"])
        power = {"": speed**2, "nan": float("nan"), "inf": float("inf")}[parameters["odd"]]
        return {"speed": speed, "power": power, "slope": float(context.get("slope", 0.0))}


class FastWheels(Wheels):
    """Drives faster where nobody states otherwise."""

    max_velocity = Parameter(0.5, minimum=0.0, maximum=1.0, unit="m/s")


class LightWheels(Wheels):
    """Takes half of the power."""

    @classmethod
    def estimate(cls, parameters: dict[str, PlainValue], context: dict[str, PlainValue]) -> dict[str, float]:
        found = super().estimate(parameters, context)
        return {**found, "power": found["power"] / 2}


def wheeled() -> Architecture:
    return robot().with_component(spec(Wheels, "wheels"))


SPEED = varied("wheels", Kind.PARAMETER, "max_velocity", (0.1, 0.26, 0.5), "speed")


def chosen(
    slots: list[Slot],
    utility: str,
    context: dict[str, Any] | None = None,
    rulebook: Rulebook | None = None,
    architecture: Architecture | None = None,
    **more: Any,
) -> Choice:
    now = architecture or wheeled()
    assume = tuple((name, Expression(text)) for name, text in more.pop("assume", {}).items())
    named = {name: Expression(text) for name, text in more.pop("named", {}).items()}
    objective = Objective(Expression(utility), assume, named)
    evaluation = Evaluation(slots, objective, context or {}, ClassEstimates(now))
    found = choose(evaluation, rulebook or Rulebook(), now, BranchAndBound(), **more)
    oracle = choose(
        Evaluation(slots, objective, context or {}, ClassEstimates(now)),
        rulebook or Rulebook(),
        now,
        Exhaustive(),
        **more,
    )
    assert found.utility == (None if oracle.utility is None else pytest.approx(oracle.utility, abs=1e-9))
    return found


def parts(name: str, least: int, most: int, **impacts: dict[str, float]) -> Slot:
    """Return a slot of parts that bring figures along and set nothing."""
    return Slot(name, tuple(Alternative(part, (), dict(each)) for part, each in impacts.items()), least, most)


# --- what is chosen ---


def test_weights_by_the_context_decide_what_is_best() -> None:
    sensors = parts("sensors", 0, 2, camera={"sight": 3, "power": 2}, ear={"sight": 1, "power": 1}, nose={"sight": 1})
    utility = "(3.0 if dark else 1.0) * total.sight - thrift * total.power"
    assert chosen([sensors], utility, {"dark": 0.0, "thrift": 0.0}).option.values == (["camera", "ear"],)  # type: ignore[union-attr]
    thrifty = chosen([sensors], utility, {"dark": 0.0, "thrift": 5.0})
    assert thrifty.option is not None
    assert thrifty.option.values == (["nose"],)
    assert thrifty.utility == 1.0


def test_a_slot_holds_as_many_alternatives_as_it_may() -> None:
    sensors = parts("sensors", 1, 2, a={"worth": 1}, b={"worth": -1}, c={"worth": -2})
    assert len(sensors.selections) == 6
    assert chosen([sensors], "total.worth").option.values == (["a"],)  # type: ignore[union-attr]
    assert chosen([sensors], "-total.worth").option.values == (["b", "c"],)  # type: ignore[union-attr]


def test_a_slot_with_too_many_ways_to_fill_it_is_refused() -> None:
    with pytest.raises(BadMessage, match="has 184756 ways to choose, must have at most 1000"):
        parts("many", 10, 10, **{f"p{index}": {} for index in range(20)})


def test_limits_on_amounts_are_kept() -> None:
    slots = [
        parts("eye", 1, 1, good={"worth": 5, "power": 4}, poor={"worth": 1, "power": 1}),
        parts("arm", 1, 1, strong={"worth": 4, "power": 4}, weak={"worth": 1, "power": 1}),
    ]
    rulebook = Rulebook()
    rulebook.limit("there are 5 W", slots, "power", 5.0)
    found = chosen(slots, "total.worth", rulebook=rulebook)
    assert found.option is not None
    assert found.option.values == ("good", "weak")


def test_slots_that_want_different_values_of_one_thing_exclude_each_other() -> None:
    def pace(value: float) -> tuple[Setting, ...]:
        return (Setting("wheels", Kind.PARAMETER, "max_velocity", value),)

    slots = [
        Slot("task", (Alternative("haste", pace(0.5), {"worth": 2}), Alternative("calm", pace(0.1), {"worth": 1}))),
        Slot("law", (Alternative("town", pace(0.1), {"worth": 2}), Alternative("moor", pace(0.5), {"worth": 0}))),
    ]
    rulebook = Rulebook()
    rulebook.exclude_contradictions(slots)
    found = chosen(slots, "total.worth", rulebook=rulebook)
    assert found.option is not None
    assert found.option.values == ("calm", "town")


def test_estimates_of_classes_under_the_settings_are_weighed() -> None:
    assert chosen([SPEED], "wheels.speed - wheels.power").option.values == (0.5,)  # type: ignore[union-attr]
    assert chosen([SPEED], "wheels.speed - price * wheels.power", {"price": 3.0}).option.values == (0.1,)  # type: ignore[union-attr]


def test_another_class_is_asked_for_its_own_estimate() -> None:
    kinds = tuple(
        Alternative(cls.__name__, (Setting("wheels", Kind.CLASS, "", class_path(cls)),))
        for cls in (Wheels, LightWheels)
    )
    found = chosen([SPEED, Slot("wheels_class", kinds)], "wheels.speed - 1.5 * wheels.power")
    assert found.option is not None
    assert found.option.values == (0.5, "LightWheels")
    assert found.changes == (Swap("wheels", class_path(LightWheels), {"max_velocity": 0.5}),)


def test_a_value_that_only_the_default_of_the_former_class_gave_is_given_to_the_next() -> None:
    kinds = tuple(
        Alternative(cls.__name__, (Setting("wheels", Kind.CLASS, "", class_path(cls)),)) for cls in (Wheels, FastWheels)
    )
    rulebook = Rulebook()
    rulebook.exclude("only the fast ones are left", [Slot("wheels_class", kinds)], 0, 0b01)
    found = chosen([Slot("wheels_class", kinds), SPEED], "-abs(wheels.speed - 0.26)", rulebook=rulebook)
    assert found.option is not None
    assert found.option.values == ("FastWheels", 0.26)
    assert found.changes == (Swap("wheels", class_path(FastWheels), {"max_velocity": 0.26}),)


def test_what_stands_stays_unless_something_is_better_by_the_margin() -> None:
    assert chosen([SPEED], "0.0 * wheels.speed").changes == ()
    assert chosen([SPEED], "wheels.speed", margin=0.3).changes == ()
    assert chosen([SPEED], "wheels.speed", margin=0.2).changes == (SetParameters("wheels", {"max_velocity": 0.5}),)


def test_what_stands_but_is_excluded_now_is_left() -> None:
    rulebook = Rulebook()
    rulebook.exclude("the drive is hot", [SPEED], 0, 0b110)
    found = chosen([SPEED], "wheels.speed", rulebook=rulebook, margin=10.0)
    assert found.changes == (SetParameters("wheels", {"max_velocity": 0.1}),)
    assert [(each.alternative, each.why) for each in found.explanation.excluded] == [
        (0.26, "the drive is hot"),
        (0.5, "the drive is hot"),
    ]


def test_a_sum_over_thirty_slots_is_taken_apart_and_solved() -> None:
    slots = [parts(f"s{i}", 1, 1, **{f"a{j}": {"worth": (i * j) % 7.0} for j in range(10)}) for i in range(30)]
    now = wheeled()
    evaluation = Evaluation(slots, Objective(Expression("2.0 * total.worth - 1.0")), {}, ClassEstimates(now))
    found = choose(evaluation, Rulebook(), now, BranchAndBound())
    assert found.utility == 2.0 * sum(max((i * j) % 7 for j in range(10)) for i in range(30)) - 1.0
    assert found.explanation.proven


def test_an_objective_that_ties_too_much_together_is_refused_saying_what() -> None:
    slots = [parts(f"s{i}", 1, 1, **{f"a{j}": {"worth": float(j)} for j in range(10)}) for i in range(6)]
    names = ", ".join(f"s{i}.worth" for i in range(6))
    with pytest.raises(BadMessage, match=r"ties s0, s1, .* together, in 1000000 combinations: must be at most 50000"):
        chosen(slots, f"max({names})")


# --- what is not known ---


@pytest.mark.parametrize("odd", ["nan", "inf"])
def test_an_estimate_that_is_no_number_counts_as_unknown_and_is_said(odd: str) -> None:
    ways = varied("wheels", Kind.PARAMETER, "odd", ("", odd), "odd")
    found = chosen([ways], "-wheels.power")
    assert found.option is not None
    assert found.option.values == ("",)
    assert found.explanation.unknown == (f"wheels.power is {odd}: must be finite",)
    assert [each.alternative for each in found.explanation.excluded] == [odd]


def test_where_nothing_is_known_nothing_is_chosen_and_it_says_what_is_missing() -> None:
    found = chosen([SPEED], "wheels.speed * daylight")
    assert (found.option, found.utility, found.changes) == (None, None, ())
    assert found.explanation.nothing == "nothing can be expected: daylight is not known"


def test_where_rules_leave_nothing_the_guilty_ones_are_named() -> None:
    rulebook = Rulebook()
    rulebook.exclude("fault a", [SPEED], 0, 0b011)
    rulebook.exclude("fault b", [SPEED], 0, 0b001)
    rulebook.exclude("fault c", [SPEED], 0, 0b100)
    found = chosen([SPEED], "wheels.speed", rulebook=rulebook)
    assert found.option is None
    assert found.explanation.nothing == "fault a, and fault c, together leave no option: change one of them"


def test_an_assumption_depends_on_what_is_chosen() -> None:
    found = chosen([SPEED], "wheels.speed - wheels.slope", assume={"slope": "1.0 if speed > 0.3 else 0.0"})
    assert found.option is not None
    assert found.option.values == (0.26,)


# --- the explanation ---


def test_the_explanation_has_runners_up_predictions_and_whether_it_is_proven() -> None:
    found = chosen([SPEED], "wheels.speed", predicted={"power": Expression("wheels.power")})
    told = found.explanation
    assert [(each.values, each.utility) for each in told.runners_up] == [((0.26,), 0.26), ((0.1,), 0.1)]
    (power,) = told.predicted
    assert (power.name, power.before, power.after) == ("power", pytest.approx(0.0676), 0.25)
    assert (told.standing, told.proven, told.gap, told.combinations) == (0.26, True, 0.0, 3)


# --- what an alternative means ---


def test_settings_of_every_kind_become_the_changes_that_lead_to_them() -> None:
    now = replace(robot(), hosts=("local", "base"))
    settings = [
        Setting("lamp", Kind.PRESENCE, "", {"class": class_path(Wheels), "parameters": {"odd": ""}}),
        Setting("lamp", Kind.PARAMETER, "max_velocity", 0.2),
        Setting("navigator", Kind.PARAMETER, "planner", "careful"),
        Setting("drive", Kind.PORT, "velocity", "slow/velocity"),
        Setting("drive", Kind.HOST, "", "base"),
        Setting("drive", Kind.STATE, "", "unconfigured"),
    ]
    assert misfit_texts(settings, now) == []
    added, *others = changes_for(settings, now)
    assert isinstance(added, Add)
    assert (added.spec.cls, added.spec.parameters) == (class_path(Wheels), {"odd": "", "max_velocity": 0.2})
    assert others == [
        Move("drive", "base"),
        SetParameters("navigator", {"planner": "careful"}),
        Connect("drive", "velocity", "slow/velocity"),
        ChangeState("drive", Transition.DEACTIVATE),
        ChangeState("drive", Transition.CLEANUP),
    ]
    absent = [Setting("drive", Kind.PRESENCE, "", False), Setting("drive", Kind.STATE, "", "inactive")]
    assert changes_for(absent, now) == (Remove("drive"),)
    assert changes_for(absent, now.without({"drive"})) == ()


def test_what_stands_is_found_by_its_settings() -> None:
    both = Slot(
        "parts",
        tuple(
            Alternative(name, (Setting(name, Kind.STATE, "", "active"),)) for name in ("navigator", "drive", "missing")
        ),
        0,
        3,
    )
    assert both.selections[standing([both], robot())[0]] == (0, 1)  # type: ignore[index]
    assert standing([varied("wheels", Kind.PARAMETER, "max_velocity", (0.9,), "speed")], wheeled()) is None


def misfit_texts(settings: list[Setting], now: Architecture) -> list[str]:
    return [f"{each.part}: {each.why}" for each in misfits([Slot("s", (Alternative("a", tuple(settings)),))], now)]


@pytest.mark.parametrize(
    ("setting", "wrong"),
    [
        (Setting("driv", Kind.STATE, "", "active"), "component: there is no component 'driv'; did you mean 'drive'?"),
        (Setting("drive", Kind.HOST, "", "locl"), "value: there is no host 'locl'; did you mean 'local'?"),
        (Setting("drive", Kind.STATE, "", "finalized"), "value: 'finalized' is no state to stay in"),
        (Setting("drive", Kind.PRESENCE, "", {"clas": "a:B"}), "value: "),
        (Setting("lamp", Kind.PRESENCE, "", True), "component: 'lamp' is not there, and cannot be added"),
    ],
)
def test_a_setting_that_cannot_be_is_refused_saying_what_could(setting: Setting, wrong: str) -> None:
    (found,) = misfit_texts([setting], robot())
    assert found.startswith(wrong)


# --- objectives taken apart ---


def test_sums_are_multiplied_out_and_the_value_stays() -> None:
    text = "w * (a - (b + c) / 2) - -d + max(a, b)"
    values = {"w": 3.0, "a": 5.0, "b": 7.0, "c": 11.0, "d": 13.0}
    found = summands(Expression(text))
    assert len(found) == 5
    assert sum(each.number(values) for each in found) == Expression(text).number(values)


def test_named_expressions_are_put_in_and_circles_refused() -> None:
    named = {"cost": Expression("price * q.power"), "q.power": Expression("a + b")}
    assert [each.text for each in summands(Expression("-cost"), named)] == ["-(price * a)", "-(price * b)"]
    with pytest.raises(BadMessage, match="a -> b -> a: is defined by itself"):
        summands(Expression("a"), {"a": Expression("b"), "b": Expression("1 + a")})


@pytest.mark.parametrize(("kind", "value"), [(Kind.STATE, "active"), (Kind.TRANSITION, "activate")])
def test_of_a_component_that_has_been_removed_meanwhile_the_change_is_named_for_the_manager(
    kind: Kind, value: str
) -> None:
    changes = changes_for([Setting("gone", kind, "", value)], wheeled())
    assert changes == (ChangeState("gone", Transition.ACTIVATE),)
