"""Changes that FROG is adapted by."""

from __future__ import annotations

from typing import Any

TEMPLATE = "regraft.services.detector.template_detector:TemplateDetector"
FEATURE = "regraft.services.detector.detector:Detector"
PURSUIT = "regraft.services.navigator.pursuit_navigator:PursuitNavigator"
ROLLOUTS = "regraft.services.navigator.navigator:Navigator"
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


def swap(component: str, cls: str = "") -> dict[str, Any]:
    """Return a swap for another class, or for a successor of the same."""
    return {"change": "swap", "component": component, "class": cls}
