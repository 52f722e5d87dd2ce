"""Reading the words of a rule by which a world file has something drawn.

A rule is `<custom><text name="..." data="..."/>`, whose data are words and values. A dataclass has the words of a rule
as its fields. The default of a field shows which values its word takes: LOW HIGH, a number, or a name.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import MISSING, Field, dataclass, fields
from typing import Any, Final, TypeVar

from regraft.sim_service.layout.placement_reading import words_of
from regraft.sim_service.layout.scene import Scene, SceneError

GOALS: Final = "goals"
"""The MJCF tuple of the bodies to visit."""
MATERIAL: Final = "_material"
"""The end of a word that names a material."""
CLEAR: Final = "clear"

Range = tuple[float, float]


@dataclass(frozen=True, slots=True)
class Rule:
    """The words that all rules have; lengths in m, positions in the map frame."""

    x: Range
    y: Range
    wall_height: Range = (0.5, 0.5)
    visits: int = 0
    lamps: Range = (1.0, 1.0)
    clear: tuple[str, float] | None = None
    wall_material: str = ""
    box_material: str = ""
    lidar: float = 0.1


R = TypeVar("R", bound=Rule)


def read_rule(scene: Scene, text: str, kind: type[R]) -> R | None:
    """Return the rule that a world's text of this name has, None if there is no such text.

    Raises:
        SceneError: the rule is malformed, or names a site or material that does not exist.
    """
    texts = scene.texts()
    if text not in texts:
        return None
    known = {each.name: each for each in _in_order(kind)}
    counts = {name: 1 if isinstance(each.default, str | int | float) else 2 for name, each in known.items()}
    words = words_of(scene, text, texts[text], counts)
    for name, each in known.items():
        if each.default is MISSING and name not in words:
            raise SceneError(f"{scene.path}: text {text!r} lacks {name!r} and its range")
    rule = kind(**{word: _value(scene, text, word, values, known[word].default) for word, values in words.items()})
    check_at_least_zero(scene, text, {"lamps": rule.lamps[0]})
    check_positive(scene, text, {"wall_height": rule.wall_height[0]})
    if rule.clear is not None:
        scene.index("site", rule.clear[0])
    for name in filter(None, (getattr(rule, word) for word in known if word.endswith(MATERIAL))):
        scene.index("material", name)
    return rule


def check_positive(scene: Scene, text: str, lows: Mapping[str, float]) -> None:
    """Check that the lowest lengths (m) of words are more than 0; raises SceneError."""
    for word, low in lows.items():
        if low <= 0.0:
            raise wrong(scene, text, word, f"{low:g}: must be more than 0 m")


def check_at_least_zero(scene: Scene, text: str, lows: Mapping[str, float]) -> None:
    """Check that the lowest numbers of words are at least 0; raises SceneError."""
    for word, low in lows.items():
        if low < 0.0:
            raise wrong(scene, text, word, f"{low:g}: must be at least 0")


def wrong(scene: Scene, text: str, word: str, why: object) -> SceneError:
    """Return the error for the values of one word."""
    return SceneError(f"{scene.path}: text {text!r}: {word!r}: {why}")


def _in_order(kind: type[Rule]) -> list[Field[Any]]:
    """Return the words of a rule as errors list them: the floor, the rule's own words, and those of all rules."""
    shared = [each.name for each in fields(Rule)]
    return sorted(fields(kind), key=lambda each: (each.default is not MISSING, each.name in shared))


def _value(scene: Scene, text: str, word: str, values: list[str], usual: object) -> Any:
    """Return the values of a word in the form of its usual ones."""
    try:
        if word == CLEAR:
            return values[0], _number(values[1])
        if isinstance(usual, str):
            return values[0]
        of_usual = usual if isinstance(usual, tuple) else (usual,)
        read = _count if isinstance(of_usual[0], int) else _number
        numbers = tuple(read(value) for value in values)
    except ValueError as error:
        raise wrong(scene, text, word, error) from error
    if len(numbers) == 1:
        return numbers[0]
    if numbers[0] > numbers[1]:
        raise wrong(scene, text, word, f"{values[0]} {values[1]}: must be LOW HIGH")
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
