"""Reading from a world file how its ring of corridors is drawn.

The rule is `<custom><text name="corridors" data="..."/>`; docs/robots.md has its words in a table. Four corridors go
round a solid core. Doors and niches are recesses in the walls, which robots can localize by.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from regraft.sim_service.layout.scene import Scene
from regraft.sim_service.rooms.words import Range, Rule, check_at_least_zero, check_positive, read_rule, wrong

TEXT: Final = "corridors"
BACK: Final = 0.1
"""m of wall behind the deepest recess."""
MIN_CORE: Final = 1.0
"""m: the least side of the core without its walls."""
MIN_BOX: Final = 0.15
"""m: the least distance that a box reaches into a corridor."""


@dataclass(frozen=True, slots=True)
class CorridorRule(Rule):
    """How a ring of corridors is drawn; lengths in m, positions in the map frame."""

    width: Range = (2.0, 2.6)
    doors: tuple[int, int] = (0, 0)
    door: Range = (0.85, 0.95)
    door_depth: Range = (0.12, 0.2)
    door_material: str = ""
    niches: tuple[int, int] = (0, 0)
    niche_size: Range = (0.8, 1.6)
    niche_depth: Range = (0.25, 0.4)
    clutter: tuple[int, int] = (0, 0)
    box_size: Range = (0.4, 0.7)
    box_height: Range = (0.5, 0.9)
    passage: float = 1.1
    place_material: str = ""

    @property
    def thickness(self) -> float:
        """How far (m) walls reach behind their face."""
        return max(self.door_depth[1], self.niche_depth[1]) + BACK


def corridor_rule(scene: Scene) -> CorridorRule | None:
    """Return the rule of a world, None if it has none.

    Raises:
        SceneError: the rule is malformed, or names a site or material that does not exist.
    """
    rule = read_rule(scene, TEXT, CorridorRule)
    if rule is None:
        return None
    ranges = ("width", "door", "door_depth", "niche_size", "niche_depth", "box_size", "box_height")
    check_positive(scene, TEXT, {word: getattr(rule, word)[0] for word in ranges})
    check_at_least_zero(scene, TEXT, {"passage": rule.passage})
    needed = 2.0 * (rule.width[1] + rule.thickness) + MIN_CORE
    for word, (low, high) in (("x", rule.x), ("y", rule.y)):
        if high - low < needed:
            why = f"{high - low:g} m: two corridors and the core between them need {needed:g} m"
            raise wrong(scene, TEXT, word, why)
    widest = rule.width[0] - 2.0 * MIN_BOX
    if rule.clutter[1] and rule.passage > widest:
        why = f"{rule.passage:g}: must be at most {widest:g} m, to leave room for boxes on both sides"
        raise wrong(scene, TEXT, "passage", why)
    return rule
