"""What the tests of components share: a simulated world on a rig, moved on tick by tick."""

from pathlib import Path

from regraft.testing import Rig
from sim_service.world import World

FROG = str(Path(__file__).parents[2] / "stacks" / "frog" / "world.xml")
TICK = 0.05


def world_on(rig: Rig, **parameters: object) -> World:
    """Add FROG's world to a rig."""
    return rig.add(World, parameters={"file": FROG, **parameters})


def run(rig: Rig, world: World, seconds: float) -> None:
    """Let time pass as the source of simulated time does: the clock, the world, then everybody else."""
    for _ in range(round(seconds / TICK)):
        rig.clock.advance_to(rig.clock.now() + round(TICK * 1e9))
        world.advance(world.ticks, TICK)
        rig.settle()
