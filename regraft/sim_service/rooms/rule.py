"""Reading from a world file how its room is drawn.

The rule is `<custom><text name="room" data="..."/>`, whose data are words and values: `x LOW HIGH  y LOW HIGH` (m,
required) is the floor that is there. `walls LOW HIGH` is the number of inner walls, each with one `door LOW HIGH` (m
wide), `wall_height LOW HIGH` (m) high. `boxes LOW HIGH` is the number of boxes, with sides of `box_size LOW HIGH` (m),
`box_height LOW HIGH` (m) high and `gap METRES` away from everything. The first `visits NUMBER` of them become goals,
before those of the tuple `goals`. `lamps LOW HIGH` is how bright the lamps are, 1 being as the file has them. Walls
and boxes keep `clear SITE METRES` from a site, and are made of `wall_material NAME` and `box_material NAME`. Robots
look for goals at the height `lidar METRES`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from regraft.sim_service.layout.scene import Scene
from regraft.sim_service.rooms.words import Range, Rule, check_at_least_zero, check_positive, read_rule, wrong

TEXT: Final = "room"


@dataclass(frozen=True, slots=True)
class RoomRule(Rule):
    """How a room is drawn; lengths in m, positions in the map frame."""

    walls: tuple[int, int] = (0, 0)
    door: Range = (0.8, 1.4)
    boxes: tuple[int, int] = (0, 0)
    box_size: Range = (0.2, 0.4)
    box_height: Range = (0.15, 0.3)
    gap: float = 0.5


def room_rule(scene: Scene) -> RoomRule | None:
    """Return the rule of a world, None if its room is as the file has it.

    Raises:
        SceneError: the rule is malformed, or names a site or material that does not exist.
    """
    rule = read_rule(scene, TEXT, RoomRule)
    if rule is None:
        return None
    lows = {"door": rule.door[0], "box_size": rule.box_size[0], "box_height": rule.box_height[0]}
    check_positive(scene, TEXT, lows)
    check_at_least_zero(scene, TEXT, {"gap": rule.gap})
    if rule.visits > rule.boxes[0]:
        raise wrong(scene, TEXT, "visits", f"{rule.visits}: must be at most {rule.boxes[0]} boxes")
    return rule
