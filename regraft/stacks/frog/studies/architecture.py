"""Evaluation B of ReBeT: does adapting the architecture pay? (E. G. Alberts et al., ACSOS 2024, section IV-B.)

``published`` runs the plans as they were published, faults included. ``corrected`` compares ways to decide that have
the same options, fixed rules and controls: with the corner camera blocked for 30 % of the time, and in rooms that
differ. `regraft.stacks.frog.studies.arms` has them.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from random import Random

from regraft.evaluation.study import Changes, Configuration, Study
from regraft.stacks.frog.studies.architecture_report import report
from regraft.stacks.frog.studies.arms.arms import configurations, mission
from regraft.stacks.frog.studies.arms.columns import COLUMNS
from regraft.stacks.frog.studies.blocking import SECONDS

FOLDER = Path(__file__).parents[1]
PHASE, PHASE_SPREAD = 51.8, 0.7
"""s: where the light is when a mission begins, and its standard deviation in the published runs."""
MAPPING = [
    {"topic": "odometry", "field": "twist.linear", "reduce": "norm", "entry": "speed", "rate": 10, "stale_after": 1},
    {
        "topic": "scan",
        "field": "ranges",
        "reduce": "min",
        "at_least": 0.12,
        "if_none": 3.5,
        "entry": "nearest",
        "rate": 5,
        "stale_after": 1,
    },
    {"topic": "power", "field": "consumers.motion", "entry": "motion_power", "rate": 2, "stale_after": 3},
    {"topic": "architecture", "field": "components.detector.connect.image", "entry": "image_topic", "rate": 1},
    {
        "topic": "architecture",
        "field": "components.navigator.parameters.max_velocity",
        "entry": "max_velocity",
        "rate": 1,
    },
]
POSE = [
    {"topic": "odometry", "field": "pose.position.x", "entry": "robot_x", "rate": 5, "stale_after": 1},
    {"topic": "odometry", "field": "pose.position.y", "entry": "robot_y", "rate": 5, "stale_after": 1},
    {"topic": "odometry", "field": "pose.orientation.z", "entry": "robot_qz", "rate": 5, "stale_after": 1},
    {"topic": "odometry", "field": "pose.orientation.w", "entry": "robot_qw", "rate": 5, "stale_after": 1},
]
CORNER_HEALTH = {"topic": "corner_health", "field": "faults", "reduce": "length", "entry": "corner_faults", "rate": 2}
FROG = "regraft.stacks.frog"
NODES = f"{FROG}.quality:REQUIREMENTS {FROG}.plans:PLANS {FROG}.studies.published_plans:NODES"
RAYS = {"parameters": {"renderer": "ray"}}
"""Draws equal pictures on every machine: results can be made again where OpenGL differs, or is not there."""
ADDITIONS: Changes = {
    "components": {
        "camera": RAYS,
        "corner_camera": RAYS,
        "navigator": {"parameters": {"max_velocity": 0.26}},
        "system_reflection": {"parameters": {"mapping": MAPPING}},
        "bt_executor": {"parameters": {"nodes": NODES}},
        "gateway": {"parameters": {"port": 0}},
        "rows": {
            "class": "regraft.stacks.frog.studies.rounds_recorder:RoundsRecorder",
            "parameters": {"file": "$RUN/rows.csv"},
        },
    }
}
PLANNING: Changes = {
    "topics": {"corner_health": {"type": "regraft/SensorHealth", "rate": 2}},
    "components": {
        "corner_monitor": {
            "class": "regraft.services.sensor_monitor:SensorMonitor",
            "parameters": {"expected": ["image"], "frozen_after": 1.0},
            "connect": {
                "image": "corner_camera/image",
                "sensor_health": "corner_health",
            },
        },
        "system_reflection": {"parameters": {"mapping": [*MAPPING, *POSE, CORNER_HEALTH]}},
        "forecast": {"class": "regraft.adaptation_manager.planners.forecast.forecast_planner:ForecastPlanner"},
    },
}


def timing_only(number: int) -> Changes:
    """Return how runs of one seed differ: by where the light is when the mission begins."""
    phase = PHASE + Random(f"timing {number}").gauss(0.0, PHASE_SPREAD)
    return {"components": {"lighting": {"parameters": {"phase": round(phase, 3)}}}}


def _always(changes: Changes) -> Callable[[int], Changes]:
    def given(seed: int) -> Changes:
        return changes

    return given


PUBLISHED = (
    Configuration("baseline", "0.26 m/s, one picture of the own camera", _always(mission("rounds_baseline"))),
    Configuration("internal", "the published internal plans", _always(mission("published_internal"))),
    Configuration(
        "external", "a bandit with the published reward for the speed", _always(mission("published_external"))
    ),
)
STUDY = Study(
    "frog-architecture",
    "Does adapting the architecture raise FROG's utility?",
    FOLDER / "rounds.yaml",
    {"corrected": tuple(configurations(PLANNING)), "published": PUBLISHED},
    report,
    ADDITIONS,
    timing_only,
    SECONDS,
    measures=COLUMNS,
    claims={"corrected": FOLDER / "studies" / "arms" / "claims.yaml"},
)
