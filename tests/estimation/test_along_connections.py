"""An estimator is given what the estimators feeding its inputs give, by port; where a figure comes from is said."""

from __future__ import annotations

import random
from collections.abc import Iterator, Mapping
from dataclasses import replace

import pytest

from regraft.bus_schema.annotations import PlainValue
from regraft.bus_schema.model.architecture import ComponentSpec
from regraft.bus_schema.model.lifecycle import State
from regraft.bus_schema.model.qualities.estimates import Figure, Source
from regraft.bus_schema.model.qualities.qualities import Judged
from regraft.component.component import InputQualities
from regraft.estimation.calling import call
from regraft.estimation.estimation import Estimation
from tests.estimation import parts
from tests.estimation.parts import Filter, Raising, architecture, spec

SOURCE = spec(parts.Source, "source", {"made": "a"})
FIRST = spec(Filter, "first", {"taken": "a", "given": "b"})
SECOND = spec(Filter, "second", {"taken": "b", "given": "c"})
CHAIN = architecture(SECOND, FIRST, SOURCE)


def flow(estimation: Estimation, name: str) -> Figure:
    return estimation.figure(name, "flow")


def test_estimates_follow_the_connections_whatever_the_components_are_called() -> None:
    estimation = Estimation(CHAIN)
    assert flow(estimation, "second") == Figure(2.5, Source.ESTIMATED)
    renamed = architecture(*(replace(each, name=f"{9 - i}") for i, each in enumerate(CHAIN.values())))
    assert Estimation(renamed).figure("9", "flow").value == 2.5


def test_another_connection_gives_another_estimate() -> None:
    other = spec(parts.Source, "other", {"made": "d"}, parameters={"rate": 100.0})
    both = {**CHAIN, "other": other}
    moved = {**both, "first": replace(FIRST, connections={"taken": "d", "given": "b"})}
    assert flow(Estimation(both), "second").value == 2.5
    assert flow(Estimation(moved), "second").value == 25.0


def test_the_context_reaches_every_estimator() -> None:
    assert flow(Estimation(CHAIN, {"scale": 2.0}), "second").value == 5.0


@pytest.mark.parametrize(
    "feeder",
    [
        replace(SOURCE, state=State.INACTIVE),
        replace(spec(Raising, "source", {"made": "a"})),
        replace(SOURCE, connections={"made": "elsewhere"}),
        replace(SOURCE, description=None),
    ],
)
def test_whatever_is_fed_nothing_is_unknown_and_harms_nobody(feeder: ComponentSpec) -> None:
    lonely = spec(parts.Source, "lonely", {"made": "z"})
    estimation = Estimation({**CHAIN, "source": feeder, "lonely": lonely})
    assert flow(estimation, "second") == Figure(None, Source.UNKNOWN, "not given")
    assert flow(estimation, "lonely").value == 10.0


def test_an_unknown_figure_says_why() -> None:
    estimation = Estimation(
        {"source": spec(Raising, "source"), "asleep": replace(FIRST, name="asleep", state=State.INACTIVE)}
    )
    assert flow(estimation, "source").why == "estimate raised RuntimeError: no idea"
    assert flow(estimation, "asleep").why == "the component is inactive"
    assert estimation.figure("source", "seen").why == "only measured"
    assert estimation.figure("source", "flaw").why == "not declared"
    assert estimation.figure("sauce", "flow").why == "the component is not there"


def test_an_estimate_that_does_not_fit_its_declaration_is_unknown() -> None:
    estimation = Estimation(CHAIN, {"scale": float("nan")})
    assert flow(estimation, "source") == Figure(None, Source.UNKNOWN, "nan: must be finite")
    assert flow(estimation, "first").value is None
    assert flow(Estimation(CHAIN, {"scale": -1.0}), "source").why == "-10: must be at least 0 Hz"


def test_a_class_that_cannot_be_loaded_is_unknown() -> None:
    gone = replace(SOURCE, cls="tests.estimation.parts:Sauce")
    assert "estimate raised NoSuchClass" in flow(Estimation({"source": gone}), "source").why


def test_an_input_that_is_not_connected_has_nothing_to_give() -> None:
    loose = replace(FIRST, connections={"given": "b"})
    assert flow(Estimation({"first": loose}), "first") == Figure(None, Source.UNKNOWN, "not given")


def test_what_several_feeders_give_alike_is_left_out() -> None:
    twin = replace(SOURCE, name="twin")
    assert flow(Estimation({**CHAIN, "twin": twin}), "first").value is None


# --- cycles and measurements ---

LOOP = architecture(
    spec(Filter, "one", {"taken": "x", "given": "y"}),
    spec(Filter, "two", {"taken": "y", "given": "x"}),
    spec(Filter, "behind", {"taken": "y", "given": "z"}),
)


def test_a_cycle_takes_what_was_measured_last_and_says_so() -> None:
    estimation = Estimation(LOOP, measured={"one": {"flow": 8.0}, "two": {"flow": 4.0}})
    assert flow(estimation, "one") == Figure(
        2.0, Source.ASSUMED, "in a cycle, by what was measured last: one.taken from two"
    )
    assert flow(estimation, "two").value == 4.0
    assert flow(estimation, "behind") == Figure(
        1.0, Source.ASSUMED, "in a cycle, by what was measured last: one.taken from two"
    )


def test_a_cycle_of_which_nothing_was_measured_is_unknown() -> None:
    assert {flow(Estimation(LOOP), name).value for name in LOOP} == {None}


def test_a_component_that_feeds_itself_is_a_cycle() -> None:
    narcissus = spec(Filter, "narcissus", {"taken": "x", "given": "x"})
    estimation = Estimation({"narcissus": narcissus}, measured={"narcissus": {"flow": 6.0}})
    assert (flow(estimation, "narcissus").value, flow(estimation, "narcissus").source) == (3.0, Source.ASSUMED)


def test_what_only_can_be_measured_is_as_measured_until_its_component_changes() -> None:
    estimation = Estimation(CHAIN, measured={"source": {"seen": 9.5}})
    assert estimation.figure("source", "seen") == Figure(9.5, Source.MEASURED)
    other = estimation.changed({**CHAIN, "source": replace(SOURCE, parameters={"rate": 20.0})})
    assert other.figure("source", "seen") == Figure(None, Source.UNKNOWN, "only measured")
    elsewhere = estimation.changed({**CHAIN, "first": replace(FIRST, parameters={"share": 1.0})})
    assert elsewhere.figure("source", "seen") == Figure(9.5, Source.MEASURED)


# --- neighbours ---


class Counted:
    """Counts who is asked."""

    def __init__(self) -> None:
        self.asked: list[str] = []

    def __call__(self, spec: ComponentSpec, context: Mapping[str, PlainValue], inputs: InputQualities) -> Judged:
        self.asked.append(spec.name)
        return call(spec, context, inputs)


def test_only_what_a_change_can_reach_is_estimated_again() -> None:
    counted = Counted()
    lonely = spec(parts.Source, "lonely", {"made": "z"})
    base = Estimation({**CHAIN, "lonely": lonely}, call=counted)
    assert sorted(counted.asked) == ["first", "lonely", "second", "source"]
    counted.asked.clear()
    base.changed({**CHAIN, "lonely": lonely})
    assert counted.asked == []
    base.changed({**CHAIN, "lonely": replace(lonely, parameters={"rate": 1.0})})
    assert counted.asked == ["lonely"]
    counted.asked.clear()
    base.changed({**CHAIN, "lonely": lonely, "first": replace(FIRST, parameters={"share": 0.1})})
    assert counted.asked == ["first", "second"]
    counted.asked.clear()
    # The inputs stay the same, so nothing behind it is asked.
    base.changed({**CHAIN, "lonely": lonely, "source": replace(SOURCE, parameters={"rate": 10.0})})
    assert counted.asked == ["source"]


def neighbours(draw: random.Random, specs: dict[str, ComponentSpec]) -> Iterator[dict[str, ComponentSpec]]:
    """Yield architectures that each differ from the last one in a part."""
    topics = [f"t{number}" for number in range(6)]
    for number in range(60):
        name = draw.choice(sorted(specs))
        old = specs[name]
        kind = draw.randrange(5)
        if kind == 0:
            values = {"rate": draw.uniform(0.0, 100.0)} if "Source" in old.cls else {"share": draw.random()}
            specs = {**specs, name: replace(old, parameters=values)}
        elif kind in (1, 2):
            port = draw.choice(["made"] if "Source" in old.cls else ["taken", "given", "unread"])
            specs = {**specs, name: replace(old, connections={**old.connections, port: draw.choice(topics)})}
        elif kind == 3:
            state = draw.choice([State.ACTIVE, State.INACTIVE])
            specs = {**specs, name: replace(old, state=state)}
        elif len(specs) > 4:
            specs = {other: each for other, each in specs.items() if other != name}
        else:
            cls = draw.choice([parts.Source, Filter, Raising])
            specs = {**specs, f"new{number}": spec(cls, f"new{number}", {})}
        yield specs


@pytest.mark.parametrize("seed", range(30))
def test_a_neighbour_is_estimated_as_if_it_were_estimated_from_scratch(seed: int) -> None:
    draw = random.Random(seed)
    specs: dict[str, ComponentSpec] = {
        f"c{number}": spec(draw.choice([parts.Source, Filter]), f"c{number}", {}) for number in range(8)
    }
    measured = {f"c{number}": {"flow": float(number)} for number in range(8)}
    nothing = Estimation({}, measured=measured)
    step = nothing.changed(specs)
    for specs in neighbours(draw, specs):  # noqa: B020
        step = step.changed(specs)
        assert step.figures == nothing.changed(specs).figures
