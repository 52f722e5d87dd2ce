"""FROG's components are swapped while it drives: its mission does not notice, and equal runs stay equal."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from regraft.bus_schema.messages.geometry import Twist
from regraft.bus_schema.messages.mission import MissionState, MissionStatus
from regraft.bus_schema.messages.perception import Detections
from regraft.bus_schema.model.adaptation import AdaptationReport, AdaptationRequest, Outcome, Swap
from tests.frog.conftest import StartFrog
from tests.frog.scripted import applied, scripted, twice
from tests.support.frog import Frog, run_frog, speed_of
from tests.support.waiting import PATIENCE, wait_until

TEMPLATE = "regraft.services.detector.template_detector:TemplateDetector"
FEATURE = "regraft.services.detector.detector:Detector"
PURSUIT = "regraft.services.navigator.pursuit_navigator:PursuitNavigator"
ROLLOUTS = "regraft.services.navigator.navigator:Navigator"
FAILED = (MissionState.FAILED, MissionState.HALTED)


def _swap(component: str, cls: str = "") -> dict[str, Any]:
    return {"change": "swap", "component": component, "class": cls}


def test_the_detector_is_exchanged_while_the_mission_runs_which_does_not_notice(tmp_path: Path) -> None:
    script = [[4.0, [_swap("detector", TEMPLATE)], "detect"], [8.0, [_swap("detector", FEATURE)], "detect"]]
    run = applied(*scripted(tmp_path / "swapped", "stack.yaml", 12, script), script)
    undisturbed = run_frog(tmp_path / "undisturbed", 12, "--speed", "max").summary
    assert run.summary["distance"] == undisturbed["distance"]
    assert run.summary["pictures"]["camera"] == undisturbed["pictures"]["camera"] + 4
    assert run.summary["visits"] == undisturbed["visits"]


def test_everybody_is_swapped_and_equal_runs_are_equal(tmp_path: Path) -> None:
    others = ("camera", "corner_camera", "map_server", "battery", "lighting", "reflection", "detector")
    script = [
        [4.0, [_swap("navigator", PURSUIT)], ""],
        [5.0, [_swap(name) for name in others], ""],
        [7.03, [_swap("recorder"), _swap("bt_executor")], ""],
        [9.0, [_swap("navigator", ROLLOUTS)], ""],
    ]
    run = twice(tmp_path, "stack.yaml", 12, script)
    assert run.summary["ticks"] == 240
    assert run.summary["adaptations"]["applied"] == len(script)
    assert run.summary["contacts"] == 0
    assert run.summary["distance"] > 1.0


def test_a_detector_is_swapped_and_undone_in_a_running_frog(frog: Frog) -> None:
    velocity = frog.listen("velocity", Twist)
    looks = frog.listen("detections", Detections)
    missions = frog.listen("mission", MissionStatus)
    wait_until(lambda: any(speed_of(twist) > 0.1 for twist in velocity), "the robot to drive")
    before = frog.wait_running("detector")
    answer = frog.rest.post("/components/detector/swap", json={"class": TEMPLATE})
    assert answer.status_code == 200, answer.text
    after = frog.wait_running("detector", 2)
    assert after.pid != before.pid
    assert frog.rest.get("/components/detector").json()["name"] == "detector"
    seen = len(looks)
    wait_until(lambda: len(looks) > seen, "a look")
    undone = frog.rest.post(f"/adaptations/{answer.json()['id']}/undo")
    assert undone.status_code == 200, undone.text
    assert frog.wait_running("detector", 3).incarnation == 3
    seen = len(looks)
    wait_until(lambda: len(looks) > seen, "another look")
    assert not [status for status in missions if status.state in FAILED]
    clock = frog.clock()
    assert (clock.reproducible, clock.dropped) == (True, ())
    assert "detector" in clock.members


def test_the_gateway_is_swapped_on_its_port(start_frog: StartFrog) -> None:
    frog = start_frog("--speed", "real")
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
