"""Promises about radios."""

import math
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from regraft.bus_schema.errors import BadMessage
from regraft.bus_schema.messages.devices.signals import RadioMessage, RadioReception
from regraft.sim_service.devices.signals.radio import Radio
from regraft.sim_service.layout.scene import SceneError
from regraft.sim_service.robots import RobotSpec
from regraft.sim_service.simulation import Simulation
from regraft.sim_service.world import World
from regraft.testing import Rig

from .worlds import FLOOR, PUCK, device, found, listen, on_bus, robot, run, simulated, tick, world_on

BODY = PUCK + '<site name="radio" pos="0 0 .05"/>'
WALLS = "".join(f'<geom type="box" pos="{x} 0 .2" size=".01 .5 .2"/>' for x in (0.3, 0.6))
BETWEEN = f'{FLOOR}<body name="walls">{WALLS}</body>'


def pair(folder: Path, distance: float, body: str = FLOOR, **how: Any) -> Simulation:
    """Return two robots with radios, ``here`` and ``there``."""
    here = robot(folder, "here", [device(Radio, **how)], body=BODY)
    there = robot(folder, "there", [device(Radio, **how)], (distance, 0.0, 0.0), body=BODY)
    return simulated(folder, here, there, body=body)


def radio(simulation: Simulation, of: str) -> Radio:
    """Return a robot's radio."""
    return found(simulation, Radio, of=of)


def send(simulation: Simulation, payload: str = "hello", of: str = "there") -> None:
    """Broadcast a message."""
    radio(simulation, of).on_send(RadioMessage(payload))


def share_received(simulation: Simulation, count: int) -> float:
    """Return the share of messages that arrive."""
    got = 0
    for _ in range(count // 20):
        for _ in range(20):
            send(simulation)
        run(simulation)
        got += len(radio(simulation, "here").arriving())
    return got / count


@settings(max_examples=15, deadline=None)
@given(st.floats(0.1, 60.0), st.floats(-20.0, 10.0))
def test_a_signal_has_the_strength_that_the_path_loss_leaves(distance: float, power: float) -> None:
    with TemporaryDirectory() as folder:
        simulation = pair(Path(folder), distance, fading=0.0, power=power, sensitivity=-200.0)
    send(simulation)
    run(simulation)
    (got,) = radio(simulation, "here").arriving()
    assert (got.sender, got.payload) == ("there", "hello")
    assert got.signal == pytest.approx(power - (20 * math.log10(2450) + 30 * math.log10(distance) - 28))


def test_each_wall_weakens_a_signal(tmp_path: Path) -> None:
    free, walled = pair(tmp_path, 1.0), pair(tmp_path, 1.0, BETWEEN)
    strengths = [radio(simulation, "here").mean_signal(radio(simulation, "there")) for simulation in (free, walled)]
    assert strengths[0] - strengths[1] == pytest.approx(2 * 3.4)


def test_the_share_of_lost_messages_is_that_of_the_fading(tmp_path: Path) -> None:
    simulation = pair(tmp_path, 10.0)
    here = radio(simulation, "here")
    above = here.mean_signal(radio(simulation, "there")) + 95.0
    simulation = pair(tmp_path, 10.0, sensitivity=-95.0 + above - 8.0)
    expected = 0.5 * (1.0 + math.erf(1.0 / math.sqrt(2.0)))
    assert share_received(simulation, 2000) == pytest.approx(expected, abs=0.03)


def test_out_of_range_nothing_arrives(tmp_path: Path) -> None:
    assert share_received(pair(tmp_path, 2000.0), 100) == 0.0


def test_a_message_arrives_once_in_the_next_tick_whatever_the_order_of_the_robots(tmp_path: Path) -> None:
    simulation = pair(tmp_path, 1.0)
    here, there = (listen(simulation, "received", of=name) for name in ("here", "there"))
    for number in range(3):
        send(simulation, f"to here {number}", of="there")
        send(simulation, f"to there {number}", of="here")
        run(simulation)
    run(simulation, 0.2)
    assert [message.payload for message in here] == [f"to here {number}" for number in range(3)]
    assert [message.payload for message in there] == [f"to there {number}" for number in range(3)]


def test_another_robot_changes_nobodys_chances(tmp_path: Path) -> None:
    here, there, more = (
        robot(tmp_path, name, [device(Radio)], (x, 0.0, 0.0), body=BODY)
        for name, x in (("here", 0.0), ("there", 60.0), ("more", -1.0))
    )
    few, many = simulated(tmp_path, here, there), simulated(tmp_path, more, here, there)
    got: list[list[RadioReception]] = [[], []]
    for number in range(30):
        send(many, of="more")
        for simulation, received in zip((few, many), got, strict=True):
            send(simulation, str(number))
            run(simulation)
            received += [one for one in radio(simulation, "here").arriving() if one.sender == "there"]
    assert got[0] == got[1]
    assert 0 < len(got[0]) < 30


def test_a_silent_radio_neither_sends_nor_receives_and_a_dropout_loses_a_share(tmp_path: Path) -> None:
    simulation = pair(tmp_path, 1.0, dropout=0.3)
    radio(simulation, "here").kit.failing = "dropout"
    assert share_received(simulation, 4000) == pytest.approx(0.7, abs=0.03)
    radio(simulation, "here").kit.failing = "silent"
    assert share_received(simulation, 20) == 0.0
    send(simulation, of="here")
    run(simulation)
    assert radio(simulation, "there").arriving() == []


def test_a_restored_run_goes_on_with_what_was_queued(tmp_path: Path) -> None:
    original, successor = pair(tmp_path, 1.0), pair(tmp_path, 1.0)
    send(original)
    successor.restore(original.snapshot())
    for simulation in (original, successor):
        run(simulation)
    arrived = radio(successor, "here").arriving()
    assert arrived == radio(original, "here").arriving() != []


def one_and_two(folder: Path) -> list[RobotSpec]:
    """Return two robots with radios near each other."""
    return [
        robot(folder, name, [device(Radio, "radio")], (x, 0.0, 0.0), body=BODY)
        for name, x in (("one", 0.0), ("two", 1.0))
    ]


def test_radios_reach_each_other_through_the_world_component(tmp_path: Path) -> None:
    with Rig() as rig:
        world = world_on(rig, tmp_path, *one_and_two(tmp_path))
        received = rig.collect("two/received", RadioReception)
        rig.publish("one/send", RadioMessage("come"))
        tick(rig, world, 3)
    assert [(message.sender, message.payload) for message in received] == [("one", "come")]


SILENT: list[dict[str, Any]] = [
    {"failures": [{"at": 0.0, "device": "one/radio", "failure": "silent"}]},
    {"one/radio_failure": "silent"},
]


@pytest.mark.parametrize("silent", SILENT, ids=["by the clock", "by parameter"])
@pytest.mark.parametrize("restarted", [False, True])
def test_a_silent_radio_sends_nothing_that_comes_before_the_first_tick(
    tmp_path: Path, silent: dict[str, Any], *, restarted: bool
) -> None:
    parameters = {**on_bus(tmp_path, *one_and_two(tmp_path)), **silent}
    with Rig() as rig:
        world = rig.add(World, parameters=parameters)
        if restarted:
            world.restore(world.snapshot())
        received = rig.collect("two/received", RadioReception)
        rig.publish("one/send", RadioMessage("come"))
        rig.settle()
        tick(rig, world, 3)
    assert received == []


def test_what_a_radio_was_to_send_as_it_became_silent_is_lost(tmp_path: Path) -> None:
    fails = [("0.15", "silent"), ("0.25", "none")]
    failures = [{"at": float(at), "device": "one/radio", "failure": failure} for at, failure in fails]
    with Rig() as rig:
        world = rig.add(World, parameters={**on_bus(tmp_path, *one_and_two(tmp_path)), "failures": failures})
        received = rig.collect("two/received", RadioReception)
        for number in range(1, 7):
            rig.publish("one/send", RadioMessage(f"after {number - 1} ticks"))
            tick(rig, world)
        tick(rig, world)
    assert [message.payload for message in received] == ["after 0 ticks", "after 1 ticks", "after 5 ticks"]


def test_a_payload_that_is_too_long_is_refused() -> None:
    with pytest.raises(BadMessage, match="has 118 bytes, must have at most 116"):
        RadioMessage("ü" * 59)


def test_a_site_that_is_not_there_is_refused(tmp_path: Path) -> None:
    with pytest.raises(SceneError, match="no site named 'radio'"):
        simulated(tmp_path, robot(tmp_path, "", [device(Radio)]))
