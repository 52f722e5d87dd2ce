"""FROG is adapted over REST while it drives."""

from __future__ import annotations

import os
import signal
from collections.abc import Iterator

import pytest

from regraft.bus_schema.messages.geometry import Twist
from regraft.bus_schema.messages.perception import Detections
from regraft.bus_schema.messages.power import BatteryState
from regraft.bus_schema.messages.sensors import Odometry
from tests.support.frog import Frog, speed_of
from tests.support.paths import FROG
from tests.support.systems import home
from tests.support.waiting import wait_until

TICK = 0.05
SLOW = {"change": "set_parameters", "component": "navigator", "parameters": {"max_velocity": 0.10}}
CORNER = {"change": "connect", "component": "detector", "port": "image", "topic": "corner_camera/image"}


@pytest.fixture(scope="module")
def frog(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Frog]:
    """Return FROG, running as fast as it can; every test leaves it as it was."""
    folder = tmp_path_factory.mktemp("frog")
    with home(folder / "home"):
        frog = Frog(folder, "--speed", "max", stack=FROG)
        yield frog
        frog.end()


def test_it_is_said_when_everybody_is_active(frog: Frog) -> None:
    wait_until(lambda: "all 13 components active after" in frog.log.read_text(), "the line that says so")


def test_a_slower_speed_holds_within_a_second_and_outlives_a_crash(frog: Frog) -> None:
    odometry = frog.listen("odometry", Odometry)
    wait_until(lambda: any(speed_of(o.twist) > 0.2 for o in odometry), "the robot to drive fast")
    answer = frog.adapt(SLOW, reason="someone is near")
    assert answer.status_code == 200, answer.text
    assert answer.json()["outcome"] == "applied"
    slow_from = answer.json()["tick"] * TICK + 1.0
    frog.wait_for_time(20.0)
    after = [speed_of(o.twist) for o in odometry if o.stamp > slow_from]
    assert len(after) > 100
    assert max(after) <= 0.105
    assert max(after) > 0.05

    before = frog.wait_running("navigator")
    os.kill(before.pid, signal.SIGKILL)
    frog.wait_running("navigator", before.incarnation + 1)
    wait_until(lambda: frog.client.view("navigator").parameters["max_velocity"] == 0.10)
    back_from = frog.clock().time / 1e9
    frog.wait_for_time(30.0)
    after = [speed_of(o.twist) for o in odometry if o.stamp > back_from]
    assert 0.05 < max(after) <= 0.105
    _undo(frog, answer.json()["id"])


def _undo(frog: Frog, adaptation: str) -> None:
    undone = frog.rest.post(f"/adaptations/{adaptation}/undo")
    assert undone.json()["outcome"] == "applied", undone.text


def test_the_detector_moves_to_the_corner_camera_without_a_restart(frog: Frog) -> None:
    detections = frog.listen("detections", Detections)
    wait_until(lambda: detections, "a look")
    before = frog.wait_running("detector")
    assert {d.camera for d in detections} == {"camera"}
    answer = frog.adapt(CORNER).json()
    assert answer["outcome"] == "applied", answer
    wait_until(lambda: detections[-1].camera == "corner_camera", "a look through the corner camera")
    assert frog.wait_running("detector").pid == before.pid
    _undo(frog, answer["id"])
    seen = len(detections)
    wait_until(lambda: len(detections) > seen + 1 and detections[-1].camera == "camera", "the way back")


def test_a_deactivated_component_is_silent_and_comes_back(frog: Frog) -> None:
    states = frog.listen("battery", BatteryState)
    wait_until(lambda: states, "the battery")
    answer = frog.rest.post("/components/battery/transition", json={"transition": "deactivate"})
    assert answer.json()["outcome"] == "applied"
    said = len(states)
    frog.wait_for_time(5.0)
    assert len(states) == said
    answer = frog.rest.post("/components/battery/transition", json={"transition": "activate"})
    assert answer.json()["outcome"] == "applied"
    wait_until(lambda: len(states) > said, "the battery again")


def test_a_deactivated_navigator_stops_the_robot(frog: Frog) -> None:
    odometry = frog.listen("odometry", Odometry)
    velocity = frog.listen("velocity", Twist)
    wait_until(lambda: any(speed_of(o.twist) > 0.2 for o in odometry), "the robot to drive")
    answer = frog.rest.post("/components/navigator/transition", json={"transition": "deactivate"})
    assert answer.status_code == 200, answer.text
    still_from = answer.json()["tick"] * TICK + 1.0
    frog.wait_for_time(1.0)
    commands = len(velocity)
    frog.wait_for_time(5.0)
    assert len(velocity) == commands
    assert max(speed_of(o.twist) for o in odometry if o.stamp > still_from) < 0.005
    _undo(frog, answer.json()["id"])


def test_an_impossible_adaptation_touches_nothing_and_names_everything(frog: Frog) -> None:
    before = frog.rest.get("/architecture").json()
    answer = frog.adapt(
        {"change": "set_parameters", "component": "navigator", "parameters": {"max_velocity": 3.0, "colour": 1}},
        {"change": "connect", "component": "detector", "port": "image", "topic": "scan"},
        {"change": "transition", "component": "nobody", "transition": "activate"},
        SLOW | {"component": "battery"},
    )
    assert answer.status_code == 409
    assert answer.headers["content-type"] == "application/problem+json"
    text = answer.text
    for expected in ("max_velocity", "colour", "regraft/LaserScan", "nobody", "battery"):
        assert expected in text
    assert frog.rest.get("/architecture").json() == before
