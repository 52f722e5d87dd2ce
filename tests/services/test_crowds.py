"""Promises of groups of people who come and go in the simulated world."""

from __future__ import annotations

from typing import Any

import pytest

from regraft.bus_schema.encoding import codec
from regraft.component.component import parameter_set
from regraft.component.parameters import ParameterError
from regraft.sim_service.world import World
from regraft.testing import Rig
from tests.support.worlds import FROG_WORLD

from .rigs import FROG, run, set_parameters

WALK = [{"x": 1.5, "y": -2.0}, {"x": -1.5, "y": -2.0}]
VISITED: dict[str, Any] = {
    **FROG_WORLD,
    "file": FROG.replace("world.xml", "world_with_visitor.xml"),
    "people": [{"name": "visitor", "waypoints": WALK, "speed": 0.5, "group": "students"}],
}


def schedule(*entries: tuple[float, str, bool]) -> list[dict[str, object]]:
    """Return entries as the parameter ``crowds`` takes them."""
    return [{"at": at, "group": group, "present": present} for at, group, present in entries]


def comings(rig: Rig) -> list[tuple[float, str, bool]]:
    """Return when which group came or went."""
    told = [event for event in rig.events if event.kind == "world.crowd"]
    return [(round(event.stamp, 3), event.details["group"], event.details["present"]) for event in told]


def test_a_group_comes_and_goes_by_its_schedule() -> None:
    with Rig(seed=3) as rig:
        crowds = schedule((0.5, "students", True), (1.0, "students", False))
        world = rig.add(World, parameters={**VISITED, "crowds": crowds})
        run(rig, world, 1.5)
        assert comings(rig) == [(0.5, "students", True), (1.0, "students", False)]


def test_a_group_is_present_by_a_parameter_at_any_time_of_its_schedule() -> None:
    with Rig(seed=3) as rig:
        world = rig.add(World, parameters={**VISITED, "crowds": schedule((0.5, "students", False))})
        run(rig, world, 0.2)
        set_parameters(rig, "world", crowd="students")
        run(rig, world, 0.8)
        assert world.simulation.present == {"students"}
        set_parameters(rig, "world", crowd="")
        run(rig, world, 0.1)
        assert [(group, present) for _, group, present in comings(rig)] == [("students", True), ("students", False)]


def test_a_successor_of_the_world_knows_who_is_present_and_reports_no_group_twice() -> None:
    with Rig(seed=3) as rig:
        world = rig.add(World, parameters={**VISITED, "crowd": "students"})
        run(rig, world, 0.5)
        checkpoint = codec.encode(rig.runtimes["world"].checkpoints.snapshot())
        run(rig, world, 0.5)
        expected = world.simulation.digest()
    with Rig(seed=3, start=0.5) as rig:
        successor = rig.add(World, parameters={**VISITED, "crowd": "students"})
        successor.restore(codec.unpack_plain(checkpoint)["state"])
        run(rig, successor, 0.5)
        assert (successor.simulation.digest(), comings(rig)) == (expected, [])


@pytest.mark.parametrize(
    ("parameters", "complaint"),
    [
        (
            {"crowd": "studnets"},
            "crowd: no person has this group: there is no group 'studnets'; did you mean 'students'?",
        ),
        ({"crowds": schedule((1.0, "staff", True))}, "there is no group 'staff'; there are: students"),
        ({"people": [], "crowd": "staff"}, "there is no group 'staff'; there are none"),
        (
            {"crowds": schedule((2.0, "students", True), (1.0, "students", False))},
            "crowds.1.at: 1 comes after 2: put the records in order",
        ),
        ({"crowds": [{"at": -1.0, "group": "students", "present": True}]}, "crowds.0.at: "),
    ],
)
def test_a_group_that_no_person_has_and_entries_out_of_order_are_refused(
    parameters: dict[str, Any], complaint: str
) -> None:
    with pytest.raises(ParameterError) as raised:
        parameter_set(World, {**VISITED, **parameters})
    assert complaint in str(raised.value)


def test_a_running_world_refuses_a_group_that_no_person_has_and_keeps_those_it_has() -> None:
    with Rig(seed=3) as rig:
        world = rig.add(World, parameters={**VISITED, "crowd": "students"})
        with pytest.raises(ParameterError, match="did you mean 'students'"):
            rig.runtimes["world"].parameters.set({"crowd": "student"})
        assert world.kit.parameters.values["crowd"] == "students"
