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
from typing import Any, Final

from regraft.sim_service.layout.placement_rules import words_of
from regraft.sim_service.layout.scene import Scene, SceneError

TEXT: Final = "room"
VALUES_PER_WORD: Final = {
    "x": 2,
    "y": 2,
    "walls": 2,
    "door": 2,
    "wall_height": 2,
    "boxes": 2,
    "box_size": 2,
    "box_height": 2,
    "gap": 1,
    "visits": 1,
    "lamps": 2,
    "clear": 2,
    "wall_material": 1,
    "box_material": 1,
    "lidar": 1,
}

Range = tuple[float, float]


@dataclass(frozen=True, slots=True)
class RoomRule:
    """How a room is drawn; lengths in m, positions in the map frame."""

    x: Range
    y: Range
    walls: tuple[int, int] = (0, 0)
    door: Range = (0.8, 1.4)
    wall_height: Range = (0.5, 0.5)
    boxes: tuple[int, int] = (0, 0)
    box_size: Range = (0.2, 0.4)
    box_height: Range = (0.15, 0.3)
    gap: float = 0.5
    visits: int = 0
    lamps: Range = (1.0, 1.0)
    clear: tuple[str, float] | None = None
    wall_material: str = ""
    box_material: str = ""
    lidar: float = 0.1


def room_rule(scene: Scene) -> RoomRule | None:
    """Return the rule of a world, None if its room is as the file has it.

    Raises:
        SceneError: the rule is malformed, or names a site or material that does not exist.
    """
    texts = scene.texts()
    if TEXT not in texts:
        return None
    words = words_of(scene, TEXT, texts[TEXT], VALUES_PER_WORD)
    for word in ("x", "y"):
        if word not in words:
            raise SceneError(f"{scene.path}: text {TEXT!r} lacks {word!r} and its range")
    usual = {name: field.default for name, field in RoomRule.__dataclass_fields__.items()}
    rule = RoomRule(**{word: _value(scene, word, values, usual[word]) for word, values in words.items()})
    _check(scene, rule)
    return rule


def _value(scene: Scene, word: str, values: list[str], usual: object) -> Any:
    """Return the values of a word in the form of its usual ones."""
    try:
        if word == "clear":
            return values[0], _number(values[1])
        if isinstance(usual, str):
            return values[0]
        if word in ("walls", "boxes"):
            numbers: tuple[float, ...] = tuple(_count(value) for value in values)
        elif word == "visits":
            numbers = (_count(values[0]),)
        else:
            numbers = tuple(_number(value) for value in values)
    except ValueError as error:
        raise SceneError(f"{scene.path}: text {TEXT!r}: {word!r}: {error}") from error
    if len(numbers) == 1:
        return numbers[0]
    if numbers[0] > numbers[1]:
        raise SceneError(f"{scene.path}: text {TEXT!r}: {word!r}: {values[0]} {values[1]}: must be LOW HIGH")
    return numbers


def _number(text: str) -> float:
    number = float(text)
    if not -1000.0 <= number <= 1000.0:
        raise ValueError(f"{text}: must be within -1000 and 1000")
    return number


def _count(text: str) -> int:
    number = int(text)
    if not 0 <= number <= 100:
        raise ValueError(f"{text}: must be within 0 and 100")
    return number


def _check(scene: Scene, rule: RoomRule) -> None:
    positive = {"door": rule.door, "wall_height": rule.wall_height, "box_size": rule.box_size}
    for word, (low, _) in {**positive, "box_height": rule.box_height}.items():
        if low <= 0.0:
            raise SceneError(f"{scene.path}: text {TEXT!r}: {word!r}: {low:g}: must be more than 0 m")
    for word, low in (("lamps", rule.lamps[0]), ("gap", rule.gap)):
        if low < 0.0:
            raise SceneError(f"{scene.path}: text {TEXT!r}: {word!r}: {low:g}: must be at least 0")
    if rule.visits > rule.boxes[0]:
        raise SceneError(f"{scene.path}: text {TEXT!r}: 'visits': {rule.visits}: must be at most {rule.boxes[0]} boxes")
    if rule.clear is not None:
        scene.index("site", rule.clear[0])
    if rule.visits:
        scene.index("tuple", "goals")
    for name in filter(None, (rule.wall_material, rule.box_material)):
        scene.index("material", name)
