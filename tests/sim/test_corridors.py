"""Promises about rings of corridors that are drawn from the seed."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cache
from itertools import pairwise
from pathlib import Path

import cv2
import mujoco
import numpy as np
import numpy.typing as npt
import pytest

from regraft.sim_service.layout.ground_map import FREE, GroundMap, Rasteriser
from regraft.sim_service.layout.placement import draw_placement
from regraft.sim_service.layout.scene import Scene, SceneError, load_scene
from regraft.sim_service.people.walkers import Person, Waypoint
from regraft.sim_service.robots import Place
from regraft.sim_service.rooms.loading import load_world
from regraft.sim_service.simulation import Simulation, SimulationSettings
from regraft.sim_service.survey import goals
from tests.support.paths import ROOT
from tests.support.worlds import waffle

PATROL = ROOT / "regraft" / "stacks" / "patrol" / "world.xml"
DOCK = (0.0, -6.38)
ROBOT = (replace(waffle(place=Place(*DOCK)), radius=0.25),)
SEEDS = range(12)
ROOM_OF_PLANNERS = 0.33
PASSAGE = 1.1
CELL = 0.05
CUTS = {"south": (3.0, -7.5, 0.0), "north": (3.0, 0.0, 7.5), "west": (1.0, -15.5, 0.0), "east": (1.0, 0.0, 15.5)}
"""Where a corridor is cut: the place along it, and from where to where across."""

Mask = npt.NDArray[np.bool_]


@cache
def corridors(seed: int) -> Scene:
    """Return the patrol's world by a seed."""
    return load_world(PATROL, ROBOT, seed)


@cache
def ground(seed: int) -> GroundMap:
    """Return the map at the height of the patrol's lidar."""
    scene = corridors(seed)
    return Rasteriser(scene, draw_placement(scene, seed), 0.3, CELL).map()


def clearance(known: GroundMap) -> npt.NDArray[np.float32]:
    """Return how far (m) each cell is from what stands there."""
    free = (known.occupancy == FREE).astype(np.uint8)
    return np.asarray((cv2.distanceTransform(free, cv2.DIST_L2, 5) - 0.5) * CELL, np.float32)


def with_room(known: GroundMap, room: float) -> Mask:
    """Return the cells round the core that have so much room (m)."""
    _, regions = cv2.connectedComponents((clearance(known) >= room).astype(np.uint8), connectivity=4)
    return np.asarray(regions == regions[known.cell(0.0, -5.9)])


def parts(known: GroundMap, free: Mask, *cuts: str) -> int:
    """Return into how many parts free cells fall when corridors are cut through."""
    left = free.copy()
    for name in cuts:
        along, low, high = CUTS[name]
        is_along_x = name in ("south", "north")
        row, column = known.cell(along, low) if is_along_x else known.cell(low, along)
        row_end, column_end = known.cell(along, high) if is_along_x else known.cell(high, along)
        left[max(row, 0) : row_end + 2, max(column, 0) : column_end + 2] = False
    return cv2.connectedComponents(left.astype(np.uint8), connectivity=4)[0] - 1


def blocks(scene: Scene, *begins: str) -> dict[str, tuple[float, float, float, float]]:
    """Return x_min, y_min, x_max, y_max (m) of the geoms whose names begin so."""
    data = mujoco.MjData(scene.model)
    mujoco.mj_kinematics(scene.model, data)
    found = {}
    for name in scene.names("geom"):
        if name.startswith(begins):
            geom = scene.index("geom", name)
            (x, y, _), (half_x, half_y, _) = data.geom_xpos[geom], scene.model.geom_size[geom]
            found[name] = (float(x - half_x), float(y - half_y), float(x + half_x), float(y + half_y))
    return found


def test_equal_seeds_give_equal_corridors_and_others_differ() -> None:
    assert load_world(PATROL, ROBOT, 7).fingerprint == load_world(PATROL, ROBOT, 7).fingerprint
    assert len({corridors(seed).fingerprint for seed in SEEDS}) == len(SEEDS)


@pytest.mark.parametrize("seed", SEEDS)
def test_every_place_can_be_reached_and_places_go_round_the_ring_from_the_dock(seed: int) -> None:
    found = goals(Simulation(corridors(seed), seed))
    assert [goal.name for goal in found] == [f"place_{number}" for number in range(1, 8)]
    free = with_room(ground(seed), ROOM_OF_PLANNERS - CELL)
    assert all(free[ground(seed).cell(goal.pose.x, goal.pose.y)] for goal in found)
    bearings = [math.atan2(goal.pose.y / 7.0, goal.pose.x / 15.0) + math.pi / 2.0 for goal in found]
    turned = [bearing % (2.0 * math.pi) for bearing in bearings]
    assert turned == sorted(turned)
    assert max(np.diff([0.0, *turned, 2.0 * math.pi])) < 1.5


@pytest.mark.parametrize("seed", SEEDS)
def test_the_ring_is_whole_with_room_for_planners_and_a_passage_as_wide_as_the_rule_has_it(seed: int) -> None:
    known = ground(seed)
    for room in (ROOM_OF_PLANNERS, PASSAGE / 2.0 - CELL):
        free = with_room(known, room)
        assert [parts(known, free, name) for name in CUTS] == [1, 1, 1, 1]
        assert parts(known, free, "south", "north") == parts(known, free, "west", "east") == 2


@pytest.mark.parametrize("seed", SEEDS)
def test_a_walk_a_metre_from_the_outer_walls_is_free(seed: int) -> None:
    known = ground(seed)
    room = clearance(known)
    along = np.linspace(-1.0, 1.0, 500)
    places = [(13.9 * at, side * 5.9) for at in along for side in (-1, 1)]
    places += [(side * 13.9, 5.9 * at) for at in along for side in (-1, 1)]
    assert min(room[known.cell(x, y)] for x, y in places) >= 0.3 - CELL


def test_no_wall_is_smooth_for_more_than_six_metres_and_geoms_are_few() -> None:
    for seed in SEEDS:
        scene = corridors(seed)
        assert scene.model.ngeom < 170
        for low_x, low_y, high_x, high_y in blocks(scene, "wall_").values():
            assert min(high_x, 15.0) - max(low_x, -15.0) < 6.01
            assert min(high_y, 7.0) - max(low_y, -7.0) < 6.01
        bodies = {int(scene.model.geom_bodyid[scene.index("geom", name)]) for name in blocks(scene, "wall_", "door_")}
        assert bodies == {scene.index("body", "walls")}


def test_clutter_stands_on_alternating_sides_of_one_corridor() -> None:
    sides = set()
    for seed in SEEDS:
        boxes = list(blocks(corridors(seed), "box_").values())
        assert 4 <= len(boxes) <= 6
        middles = [((low_x + high_x) / 30.0, (low_y + high_y) / 14.0) for low_x, low_y, high_x, high_y in boxes]
        axis = 0 if all(abs(x) > 0.8 for x, _ in middles) else 1
        assert len({middle[axis] > 0.0 for middle in middles}) == 1
        steps = np.sign(np.diff([abs(middle[axis]) for middle in middles])).tolist()
        assert all(one == -other for one, other in pairwise(steps))
        sides.add((axis, middles[0][axis] > 0.0))
    assert len(sides) >= 3


def test_boxes_frames_and_places_keep_clear_of_the_dock() -> None:
    for seed in SEEDS:
        for name, (low_x, low_y, high_x, high_y) in blocks(corridors(seed), "box_", "place_", "door_").items():
            away = math.hypot(max(low_x, -high_x, 0.0), max(low_y - DOCK[1], DOCK[1] - high_y, 0.0))
            assert away >= 1.0 or (name.startswith("door_") and "frame" not in name)


def test_doors_frames_and_niches_differ_by_seed() -> None:
    doors = [[name for name in blocks(corridors(seed), "door_") if "frame" not in name] for seed in SEEDS]
    counts = [len(each) for each in doors]
    assert all(24 <= count <= 30 for count in counts)
    assert len(set(counts)) > 3
    assert all(5 <= len(blocks(corridors(seed), "niche_")) <= 8 for seed in SEEDS)
    assert sum(any("frame" in name for name in blocks(corridors(seed), "door_")) for seed in SEEDS) == len(SEEDS)


def test_people_walk_round_the_ring_and_those_of_a_group_when_it_comes() -> None:
    ring = tuple(Waypoint(x, y) for x, y in ((-13.9, 5.9), (-13.9, -5.9), (13.9, -5.9), (13.9, 5.9)))
    everyday = [Person(f"walker_{number}", ring, 1.0, loop=True) for number in (1, 2, 3)]
    crowd = [
        Person(f"crowd_{number}", ring[number - 1 :] + ring[: number - 1], 1.0, "crowd") for number in (1, 2, 3, 4)
    ]
    scene = corridors(1)
    simulation = Simulation(scene, 1, SimulationSettings(people=(*everyday, *crowd)))

    def there() -> list[bool]:
        qpos = simulation.render_state().qpos
        at = [scene.model.jnt_qposadr[scene.index("joint", f"{person.name}_x")] for person in (*everyday, *crowd)]
        return [abs(19.0 + qpos[place]) < 14.0 for place in at]

    simulation.advance(0.2)
    assert there() == [True] * 3 + [False] * 4
    simulation.set_present("crowd", present=True)
    simulation.advance(0.2)
    assert there() == [True] * 7


def world(folder: Path, rule: str, more: str = "") -> Path:
    """Write a world with a rule for its corridors."""
    file = folder / "corridors.xml"
    file.write_text(
        f"""<mujoco><custom><text name="corridors" data="{rule}"/>{more}</custom>
        <worldbody><geom type="plane" size="9 9 .1"/><site name="dock"/></worldbody></mujoco>"""
    )
    return file


def test_a_rule_without_doors_places_and_boxes_gives_bare_corridors(tmp_path: Path) -> None:
    scene = load_world(world(tmp_path, "x -8 8 y -6 6 width 1.5 1.5"), (), 1)
    assert scene.names("tuple") == []
    assert sorted(scene.names("geom")) == sorted(
        ["core", *(f"wall_{side}_{end}_1" for side in ("south", "east", "north", "west") for end in ("outer", "inner"))]
    )
    assert blocks(scene, "wall_south_inner") == {"wall_south_inner_1": pytest.approx((-6.5, -4.5, 6.5, -4.0))}


@pytest.mark.parametrize(
    ("rule", "complaint"),
    [
        ("x 0 40", "text 'corridors' lacks 'y' and its range"),
        ("x 0 40 y 0 9 dors 1 2", "unknown word 'dors'; known are: x, y, width, doors"),
        ("x 0 40 y 0 9 walls 1 2", "unknown word 'walls'"),
        ("x 0 40 y 0 9 width 2.6 2", "'width': 2.6 2: must be LOW HIGH"),
        ("x 0 40 y 0 5 width 2 2.6", "'y': 5 m: two corridors and the core between them need 7.2 m"),
        ("x 0 40 y 0 9 width 0 2", "'width': 0: must be more than 0 m"),
        ("x 0 40 y 0 9 door_depth 0 .1", "'door_depth': 0: must be more than 0 m"),
        ("x 0 40 y 0 9 doors 1 200", "'doors': 200: must be within 0 and 100"),
        ("x 0 40 y 0 9 clutter 1 2 passage 1.9", "'passage': 1.9: must be at most 1.7 m"),
        ("x 0 40 y 0 9 clear dok 1", "no site named 'dok'; there are: dock"),
        ("x 0 40 y 0 9 door_material oak", "no material named 'oak'; there are: none"),
        ("x -9 9 y -6 6 doors 90 90", r"no room after 40 draws with seed 1; the last: the wall \w+ is too short for"),
        ("x -9 9 y -6 6 clutter 20 20", "no room after 40 draws with seed 1; the last: a corridor of"),
        ("x -9 9 y -6 6 visits 90", r"no room after 40 draws with seed 1; the last: place_\d+ "),
    ],
)
def test_a_wrong_rule_is_refused_naming_word_and_value(tmp_path: Path, rule: str, complaint: str) -> None:
    with pytest.raises(SceneError, match=complaint):
        load_world(world(tmp_path, rule), (), 1)


def test_a_world_with_rules_for_a_room_and_for_corridors_is_refused(tmp_path: Path) -> None:
    file = world(tmp_path, "x -9 9 y -6 6", '<text name="room" data="x 0 4 y 0 4"/>')
    with pytest.raises(SceneError, match="has the texts 'room' and 'corridors': must have one of them"):
        load_world(file, (), 1)


@pytest.mark.parametrize("half", [(0.31, 0.17), (0.025, 0.8), (0.2, 0.2)])
def test_a_box_along_the_axes_covers_the_cells_of_one_that_is_turned_half_round(
    tmp_path: Path, half: tuple[float, float]
) -> None:
    maps = []
    for quaternion in ("1 0 0 0", "0 0 0 1"):
        file = tmp_path / "box.xml"
        box = f'<geom type="box" size="{half[0]} {half[1]} .5" pos=".013 .029 .5" quat="{quaternion}"/>'
        file.write_text(f"<mujoco><worldbody>{box}</worldbody></mujoco>")
        scene = load_scene(file)
        maps.append(Rasteriser(scene, draw_placement(scene, 1), 0.3, CELL).map().occupancy)
    np.testing.assert_array_equal(maps[0], maps[1])
