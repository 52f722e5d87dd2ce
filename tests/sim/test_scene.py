"""Promises about loading worlds."""

from dataclasses import replace
from pathlib import Path

import pytest

from regraft.sim_service.layout.placement import draw_placement
from regraft.sim_service.layout.scene import SceneError, load_scene
from regraft.sim_service.simulation import Simulation
from tests.support.worlds import waffle

from .worlds import frog

ROOM = """<mujoco><custom><text name="place thing" data="{rule}"/></custom>
<worldbody><body name="thing"><geom size=".1"/></body></worldbody></mujoco>"""


def test_missing_world_file_is_named(tmp_path: Path) -> None:
    with pytest.raises(SceneError, match=r"nowhere\.xml: no such world file"):
        load_scene(tmp_path / "nowhere.xml")


def test_broken_world_is_refused_with_file_and_element(tmp_path: Path) -> None:
    file = tmp_path / "broken.xml"
    file.write_text('<mujoco><worldbody><geom name="ball" type="sphere"/></worldbody></mujoco>')
    with pytest.raises(SceneError, match=r"broken\.xml.*\n?.*ball"):
        load_scene(file)


def test_unknown_element_is_named_with_those_that_exist() -> None:
    with pytest.raises(SceneError, match=r"world\.xml: no camera named 'eye'; there are: .*corner_camera"):
        frog().index("camera", "eye")


def test_a_robot_without_what_its_devices_need_is_refused(tmp_path: Path) -> None:
    file = tmp_path / "empty.xml"
    file.write_text('<mujoco><worldbody><body name="base"><geom size=".1"/></body></worldbody></mujoco>')
    with pytest.raises(SceneError, match=r"no joint named 'left_wheel'"):
        Simulation(load_scene(file, (replace(waffle(), model=""),)), seed=0)


@pytest.mark.parametrize(
    ("rule", "complaint"),
    [
        ("x 0 1", "lacks 'y'"),
        ("x 0 1 y 0", "'y' needs 2"),
        ("x 0 1 y 0 one", "could not convert"),
        ("x 0 1 y 0 1 colour red", "unknown word 'colour'"),
        ("x 0 1 y 0 1 seen_by eye", "no camera named 'eye'"),
    ],
)
def test_malformed_placement_rule_is_refused_by_name(tmp_path: Path, rule: str, complaint: str) -> None:
    file = tmp_path / "room.xml"
    file.write_text(ROOM.format(rule=rule))
    with pytest.raises(SceneError, match=complaint):
        draw_placement(load_scene(file), seed=0)


def test_fingerprint_tells_worlds_apart(tmp_path: Path) -> None:
    one, other = tmp_path / "one.xml", tmp_path / "other.xml"
    one.write_text(ROOM.format(rule="x 0 1 y 0 1"))
    other.write_text(ROOM.format(rule="x 0 1 y 0 2"))
    assert load_scene(one).fingerprint == load_scene(one).fingerprint
    assert load_scene(one).fingerprint != load_scene(other).fingerprint
