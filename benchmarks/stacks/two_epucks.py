"""Two e-pucks in one arena with eight components each that work in every tick."""

from __future__ import annotations

from pathlib import Path

import yaml

from benchmarks.sides.system import ROOT

EPUCK = ROOT / "tests" / "robots" / "epuck"
BEATS = 8


def written(folder: Path) -> Path:
    """Write the stack into a folder, and return its file."""
    (folder / "arena.xml").write_text((EPUCK / "arena.xml").read_text())
    robot = folder / "epuck"
    robot.mkdir()
    for file in ("__init__.py", "epuck.xml", "robot.yaml", "wall_follower.py"):
        (robot / file).write_text((EPUCK / file).read_text())
    stack = folder / "stack.yaml"
    stack.write_text(yaml.safe_dump(_stack(), sort_keys=False))
    return stack


def _stack() -> dict[str, object]:
    topics = {f"beat_{number}": {"type": "regraft/Twist"} for number in range(BEATS)}
    beat = "benchmarks.sides.beats:Beat"
    beats = {f"beat_{number}": {"class": beat, "connect": {"out": f"beat_{number}"}} for number in range(BEATS)}
    robots = {
        name: {"robot": "epuck", "place": {"x": x, "y": 0.0}, "topics": topics, "components": beats}
        for name, x in (("left", -0.15), ("right", 0.15))
    }
    return {
        "system": "two_epucks",
        "clock": "simulated",
        "seed": 1,
        "world": "arena.xml",
        "robots": robots,
        "topics": {
            "world_state": {"type": "regraft/WorldState", "rate": 20},
            "adaptations": {"type": "regraft/AdaptationReport"},
            "architecture": {"type": "regraft/Architecture"},
        },
        "components": {
            "world": {
                "class": "regraft.sim_service.world:World",
                "parameters": {"file": "$world", "robots": "$robots"},
            },
            "adaptation_manager": {
                "class": "regraft.adaptation_manager.manager:AdaptationManager",
                "parameters": {"journal": "$RUN/journal.sqlite"},
            },
            "gateway": {"class": "regraft.dashboard_api.gateway:Gateway"},
        },
    }
