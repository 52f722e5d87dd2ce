"""FROG gets components while it drives, and loses them again; equal runs stay equal."""

from __future__ import annotations

from pathlib import Path

from regraft.bus_schema.messages.geometry import Twist
from regraft.bus_schema.messages.perception import Detect, Detections, Sightings
from tests.frog.scripted import applied, scripted, twice
from tests.support.frog import Frog, speed_of
from tests.support.waiting import wait_until

SECOND_DETECTOR = {
    "change": "add",
    "component": "second_detector",
    "spec": {
        "class": "regraft.services.detector.detector:Detector",
        "parameters": {"interval": 1.0},
        "connect": {"image": "corner_camera/image", "detections": "corner_detections", "energy": "corner_energy"},
        "services": {"detect": "corner_detect"},
    },
    "topics": [
        {"name": "corner_detections", "type": "regraft/Detections"},
        {"name": "corner_energy", "type": "regraft/EnergyUse"},
    ],
}
NO_SECOND_DETECTOR = {
    "change": "remove",
    "component": "second_detector",
    "topics": ["corner_detections", "corner_energy"],
}
CAMERA = {
    "change": "add",
    "component": "camera",
    "spec": {
        "class": "regraft.sim_service.camera_component:Camera",
        "parameters": {"file": "$world", "robots": "$robots", "camera": "camera", "always_lit": True},
        "connect": {"image": "camera/image"},
    },
    "topics": [{"name": "camera/image", "type": "regraft/Image", "rate": 5.0, "reliable": False}],
}
DETECTOR = {
    "change": "add",
    "component": "detector",
    "spec": {
        "class": "regraft.services.detector.template_detector:TemplateDetector",
        "connect": {"image": "camera/image", "odometry": "localization"},
    },
    "topics": [{"name": "detections", "type": "regraft/Detections"}, {"name": "energy", "type": "regraft/EnergyUse"}],
}
NO_EXPLORER = {"change": "remove", "component": "explorer"}


def test_a_second_detector_comes_and_goes_while_frog_drives(frog: Frog) -> None:
    velocity = frog.listen("velocity", Twist)
    wait_until(lambda: any(speed_of(twist) > 0.1 for twist in velocity), "the robot to drive")
    looks = frog.listen("corner_detections", Detections)
    answer = frog.adapt(SECOND_DETECTOR, reason="two see more than one")
    assert answer.status_code == 200, answer.text
    seen = frog.client.call("corner_detect", Detect("hydrant", 1), Sightings, 30.0)
    assert seen.pictures == 1
    wait_until(lambda: looks and looks[-1].camera == "corner_camera", "a look through the corner camera")
    assert "second_detector" in frog.clock().members
    assert frog.rest.get("/components/second_detector").json()["name"] == "second_detector"
    answer = frog.adapt(NO_SECOND_DETECTOR)
    assert answer.status_code == 200, answer.text
    wait_until(lambda: "second_detector" not in frog.processes())
    frog.wait_for_time(5.0)
    assert "second_detector" not in frog.clock().members
    assert frog.clock().dropped == ()
    assert frog.clock().reproducible
    paths = [d["path"] for d in frog.rest.get("/architecture/diff?from=1&to=2").json()["differences"]]
    assert any(path.startswith("/components/second_detector") for path in paths), paths
    assert any(path.startswith("/topics/corner_detections") for path in paths), paths
    assert frog.rest.get("/architecture/diff?from=1&to=3").json()["differences"] == []


def test_equal_runs_in_which_a_component_comes_and_goes_are_equal(tmp_path: Path) -> None:
    script = [
        [3.0, [SECOND_DETECTOR], "corner_detect"],
        [6.0, [NO_SECOND_DETECTOR], ""],
        [7.0, [SECOND_DETECTOR], "corner_detect"],
    ]
    twice(tmp_path, "stack.yaml", 10, script)


def test_from_exploring_to_detecting_in_one_adaptation(tmp_path: Path) -> None:
    script = [[5.0, [NO_EXPLORER, CAMERA, DETECTOR], "detect"]]
    run = applied(*scripted(tmp_path / "run", "explore.yaml", 10, script), script)
    assert run.code == 0, run.errors
