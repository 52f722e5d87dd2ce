"""Reading from a world file which bodies may be placed where.

A rule is a `<custom><text name="place BODY" data="..."/>`, whose data are words and values:
`x LOW HIGH  y LOW HIGH` (m, required), `gap METRES` to everything else (default 0), `radius METRES` of the
body's outline (default: from its geoms). With `seen_by CAMERA` the whole body must be in that camera's
unobstructed view. With `clear SITE METRES` the body's outline keeps this far from an MJCF site, such as a dock.
"""

from collections.abc import Mapping
from dataclasses import dataclass

from regraft.sim_service.layout.footprints import body_radius
from regraft.sim_service.layout.scene import Scene, SceneError
from regraft.sim_service.robots import Region, RobotSpec

PREFIX = "place "
VALUES_PER_WORD = {"x": 2, "y": 2, "gap": 1, "radius": 1, "seen_by": 1, "clear": 2}


@dataclass(frozen=True, slots=True)
class Clearance:
    """How far (m) a body's outline must stay from a site."""

    site: str
    distance: float


@dataclass(frozen=True, slots=True)
class PlacementRule:
    """Where one body may stand; lengths in m, positions in the map frame."""

    body: str
    x_range: tuple[float, float]
    y_range: tuple[float, float]
    gap: float
    radius: float
    seen_by: str | None
    clear: Clearance | None = None


def placement_rules(scene: Scene) -> tuple[PlacementRule, ...]:
    """Return the rules of a world in the order of its file, then its robots': the order of drawing.

    A rule of the file goes before a robot's region.

    Raises:
        SceneError: a rule is malformed; it names a body, a camera or a site that does not exist; a body is not a child
            of the worldbody.
    """
    texts = scene.texts().items()
    of_world = [
        _parse(scene, name.removeprefix(PREFIX).strip(), data) for name, data in texts if name.startswith(PREFIX)
    ]
    ruled = {rule.body for rule in of_world}
    of_robots = [
        _in_region(scene, robot, robot.region)
        for robot in scene.robots
        if robot.region is not None and robot.body not in ruled
    ]
    return (*of_world, *of_robots)


def _in_region(scene: Scene, robot: RobotSpec, region: Region) -> PlacementRule:
    _check_movable(scene, robot.body)
    x, y = (region.x[0], region.x[1]), (region.y[0], region.y[1])
    return PlacementRule(robot.body, x, y, region.gap, robot.radius, seen_by=None)


def _parse(scene: Scene, body: str, data: str) -> PlacementRule:
    number = _check_movable(scene, body)
    values = words_of(scene, f"place {body}", data, VALUES_PER_WORD)
    try:
        rule = PlacementRule(
            body=body,
            x_range=(float(values["x"][0]), float(values["x"][1])),
            y_range=(float(values["y"][0]), float(values["y"][1])),
            gap=float(values["gap"][0]) if "gap" in values else 0.0,
            radius=float(values["radius"][0]) if "radius" in values else _radius(scene, body, number),
            seen_by=values["seen_by"][0] if "seen_by" in values else None,
            clear=Clearance(values["clear"][0], float(values["clear"][1])) if "clear" in values else None,
        )
    except KeyError as error:
        raise SceneError(f"{scene.path}: text 'place {body}' lacks {error.args[0]!r} and its range") from error
    except ValueError as error:
        raise SceneError(f"{scene.path}: text 'place {body}': {error}") from error
    if rule.seen_by is not None:
        scene.index("camera", rule.seen_by)
    if rule.clear is not None:
        scene.index("site", rule.clear.site)
    return rule


def _check_movable(scene: Scene, body: str) -> int:
    """Return the number of a body; raises SceneError unless it stands in the world, fixed or free."""
    number = scene.index("body", body)
    if int(scene.model.body_parentid[number]) != 0:
        raise SceneError(f"{scene.path}: body {body!r} can't be placed: it is not a child of the worldbody")
    if not scene.is_static(number):
        scene.free_joint_position(body)
    return number


def _radius(scene: Scene, body: str, number: int) -> float:
    """Return the radius (m) of a body: a robot's is in its file, any other's is that of its outline."""
    of_robots = {robot.body: robot.radius for robot in scene.robots}
    return of_robots.get(body) or body_radius(scene, number)


def words_of(scene: Scene, text: str, data: str, known: Mapping[str, int]) -> dict[str, list[str]]:
    """Return the values of each word of a rule; ``known`` has how many each word takes.

    Raises:
        SceneError: a word is unknown, given twice, or lacks values; names the text that has the rule.
    """
    words = data.split()
    values: dict[str, list[str]] = {}
    while words:
        word = words.pop(0)
        if word not in known:
            there = ", ".join(known)
            raise SceneError(f"{scene.path}: text {text!r}: unknown word {word!r}; known are: {there}")
        if word in values:
            raise SceneError(f"{scene.path}: text {text!r}: {word!r} is given twice")
        count = known[word]
        if len(words) < count:
            raise SceneError(f"{scene.path}: text {text!r}: {word!r} needs {count} value(s)")
        values[word], words = words[:count], words[count:]
    return values
