"""Where the project's files are."""

from __future__ import annotations

from pathlib import Path

ROOT = Path(__file__).parents[2]
FROG = ROOT / "regraft" / "stacks" / "frog"
TWO_ROBOTS = ROOT / "regraft" / "stacks" / "demo_two_robots"
PATROL = ROOT / "regraft" / "stacks" / "patrol"
SUAVE = ROOT / "regraft" / "stacks" / "suave"
