"""FROG is adapted over REST while it drives: by parameters, connections and states, by swaps, moves and additions."""

from __future__ import annotations

import subprocess
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import pytest

from regraft.bus_schema.messages.geometry import Twist
from regraft.bus_schema.messages.mission import MissionState, MissionStatus
from regraft.bus_schema.messages.perception import Detect, Detections, Sightings
from regraft.bus_schema.messages.power import BatteryState
from regraft.bus_schema.messages.sensors import Odometry
from regraft.bus_schema.model.adaptation import AdaptationReport, AdaptationRequest, Outcome, Swap
from tests.frog.changes import NO_SECOND_DETECTOR, SECOND_DETECTOR, TEMPLATE
from tests.support.commands import run
from tests.support.frog import Frog, speed_of
from tests.support.hosts import JoinedHost
from tests.support.machine.ports import free_port
from tests.support.machine.processes import kill
from tests.support.paths import FROG
from tests.support.systems import home
from tests.support.waiting import PATIENCE, wait_until

pytestmark = pytest.mark.slow

FAILED = (MissionState.FAILED, MissionState.HALTED)
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
    silent_from = (answer.json()["tick"] + 1.5) * TICK  # tick n ends after n + 1 periods
    frog.wait_for_time(5.0)
    assert not [state for state in states if state.stamp > silent_from]
    said = len(states)
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


def test_a_second_detector_comes_and_goes_while_frog_drives(frog: Frog) -> None:
    velocity = frog.listen("velocity", Twist)
    wait_until(lambda: any(speed_of(twist) > 0.1 for twist in velocity), "the robot to drive")
    looks = frog.listen("corner_detections", Detections)
    added = frog.adapt(SECOND_DETECTOR, reason="two see more than one")
    assert added.status_code == 200, added.text
    seen = frog.client.call("corner_detect", Detect("hydrant", 1), Sightings, 30.0)
    assert seen.pictures == 1
    wait_until(lambda: looks and looks[-1].camera == "corner_camera", "a look through the corner camera")
    wait_until(lambda: "second_detector" in frog.clock().members, "the clock has it as a member")
    assert frog.rest.get("/components/second_detector").json()["name"] == "second_detector"
    removed = frog.adapt(NO_SECOND_DETECTOR)
    assert removed.status_code == 200, removed.text
    wait_until(lambda: "second_detector" not in frog.processes())
    frog.wait_for_time(5.0)
    assert "second_detector" not in frog.clock().members
    assert frog.clock().dropped == ()
    assert frog.clock().reproducible
    before, with_it = (added.json()[revision] for revision in ("revision_before", "revision_after"))
    paths = [difference["path"] for difference in _differences(frog, before, with_it)]
    assert any(path.startswith("/components/second_detector") for path in paths), paths
    assert any(path.startswith("/topics/corner_detections") for path in paths), paths
    assert _differences(frog, before, removed.json()["revision_after"]) == []


def _differences(frog: Frog, before: int, after: int) -> list[dict[str, Any]]:
    found: list[dict[str, Any]] = frog.rest.get(f"/architecture/diff?from={before}&to={after}").json()["differences"]
    return found


def test_a_detector_is_swapped_and_undone_in_a_running_frog(frog: Frog) -> None:
    velocity = frog.listen("velocity", Twist)
    looks = frog.listen("detections", Detections)
    missions = frog.listen("mission", MissionStatus)
    wait_until(lambda: any(speed_of(twist) > 0.1 for twist in velocity), "the robot to drive")
    before = frog.wait_running("detector")
    answer = frog.rest.post("/components/detector/swap", json={"class": TEMPLATE})
    assert answer.status_code == 200, answer.text
    after = frog.wait_running("detector", before.incarnation + 1)
    assert after.pid != before.pid
    assert frog.rest.get("/components/detector").json()["name"] == "detector"
    seen = len(looks)
    wait_until(lambda: len(looks) > seen, "a look")
    undone = frog.rest.post(f"/adaptations/{answer.json()['id']}/undo")
    assert undone.status_code == 200, undone.text
    assert frog.wait_running("detector", after.incarnation + 1).incarnation == after.incarnation + 1
    seen = len(looks)
    wait_until(lambda: len(looks) > seen, "another look")
    assert not [status for status in missions if status.state in FAILED]
    clock = frog.clock()
    assert (clock.reproducible, clock.dropped) == (True, ())
    assert "detector" in clock.members


def test_the_detector_moves_to_a_second_host_and_back_and_the_mission_does_not_notice(
    frog: Frog, tmp_path: Path
) -> None:
    looks = frog.listen("detections", Detections)
    missions = frog.listen("mission", MissionStatus)
    edge = JoinedHost(frog.info.join, "edge", tmp_path / "edge.log")
    try:
        edge.wait_joined(frog)
        for host in ("edge", "local"):
            answer = frog.rest.post("/components/detector/move", json={"host": host})
            assert answer.status_code == 200, answer.text
            assert (answer.json()["outcome"], answer.json()["steps"][1]["state"]) == ("applied", "done")
            _wait_for_host(frog, "detector", host)
            _wait_for_more(looks, "the detector to look again")
        clock = frog.clock()
        assert (clock.reproducible, clock.dropped) == (True, ())
        assert not [one for one in missions if one.state in FAILED]
    finally:
        assert edge.end() == 0


def _wait_for_host(frog: Frog, component: str, host: str) -> None:
    def is_there() -> bool:
        seen = frog.client.components().get(component)
        return seen is not None and seen.host == host

    wait_until(is_there, f"{component} at {host}")


def _wait_for_more(heard: Sequence[object], what: str) -> None:
    before = len(heard)
    wait_until(lambda: len(heard) > before, what)


def test_a_second_up_of_the_same_system_and_a_port_in_use_are_said_before_anything_runs(frog: Frog) -> None:
    again = _up("--system", "tests", "--set", f"gateway.port={free_port()}")
    assert again.returncode == 2
    assert "already running" in again.stderr
    assert frog.process.poll() is None
    again = _up("--system", "other", "--set", f"gateway.port={frog.port}")
    assert again.returncode == 2
    assert str(frog.port) in again.stderr


def _up(*options: str) -> subprocess.CompletedProcess[str]:
    return run("up", str(FROG), "--headless", *options, imported="frog")


def test_the_gateway_is_swapped_on_its_port(frog: Frog) -> None:
    request = AdaptationRequest((Swap("gateway", parameters={"answer_within": 4.0}),))
    report = frog.client.call("adaptation_manager/adapt", request, AdaptationReport, PATIENCE)
    assert report.outcome is Outcome.APPLIED, report
    values = frog.client.view("gateway").parameters
    assert (values["answer_within"], values["port"]) == (4.0, frog.port)
    assert frog.rest.get("/system").status_code == 200
    answer = frog.rest.post("/components/gateway/swap", json={"parameters": {"answer_within": 5.0}})
    assert answer.status_code in (200, 503), answer.text  # whoever asks it to leave may be sent home
    wait_until(lambda: frog.client.view("gateway").parameters["answer_within"] == 5.0)
    assert frog.rest.get("/system").status_code == 200
    clock = frog.clock()
    assert (clock.reproducible, clock.dropped) == (True, ())


def test_a_slower_speed_holds_within_a_second_and_outlives_a_crash(frog: Frog) -> None:
    """The last one: a run in which a component has died is not reproducible any more."""
    odometry = frog.listen("odometry", Odometry)
    wait_until(lambda: any(speed_of(o.twist) > 0.2 for o in odometry), "the robot to drive fast")
    answer = frog.adapt(SLOW, reason="someone is near")
    assert answer.status_code == 200, answer.text
    assert answer.json()["outcome"] == "applied"
    _drives_slowly(frog, odometry, since=answer.json()["tick"] * TICK + 1.0)

    before = frog.wait_running("navigator")
    kill(before.pid)
    frog.wait_running("navigator", before.incarnation + 1)
    wait_until(lambda: frog.client.view("navigator").parameters["max_velocity"] == 0.10)
    back_from = frog.clock().time / 1e9
    _drives_slowly(frog, odometry, since=back_from)
    _undo(frog, answer.json()["id"])


def _drives_slowly(frog: Frog, odometry: list[Odometry], since: float) -> None:
    """Wait until the robot drives after ``since``, and for six seconds more, in which it must not drive fast."""

    def speeds() -> list[float]:
        return [speed_of(o.twist) for o in odometry if o.stamp > since]

    wait_until(lambda: max(speeds(), default=0.0) > 0.05, "the robot to drive slowly", 60.0)
    # By the odometry itself: at full speed seconds pass between two reports of the clock.
    end = odometry[-1].stamp + 6.0
    wait_until(lambda: odometry[-1].stamp >= end, "six seconds more of odometry", 60.0)
    assert len(speeds()) > 100
    assert max(speeds()) <= 0.105


def test_none_of_frogs_components_is_called_unrepeatable(frog: Frog) -> None:
    assert "component.unrepeatable" not in frog.log.read_text()
