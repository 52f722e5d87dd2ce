"""Promises about loading worlds."""

from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest

from regraft.sim_service.layout.placement import draw_placement
from regraft.sim_service.layout.scene import SceneError, load_scene
from regraft.sim_service.robots import RobotSpec
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


HULLED = """<mujoco>
<asset>
  <mesh name="hull" file="hull.obj"/><texture name="paint" type="2d" file="paint.png"/>
  <material name="painted" texture="paint"/>
</asset>
<worldbody><body name="base"><freejoint/><geom type="mesh" mesh="hull" material="painted"/></body></worldbody>
</mujoco>"""
HULL = "v 0 0 0\nv {length} 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"


def installed(folder: Path, length: float = 1.0, shade: int = 200) -> Simulation:
    """Return a simulation of a robot with a mesh and a texture, whose files are in a folder."""
    folder.mkdir(parents=True)
    (folder / "hull.obj").write_text(HULL.format(length=length))
    cv2.imwrite(str(folder / "paint.png"), np.full((4, 4, 3), shade, np.uint8))
    (folder / "robot.xml").write_text(HULLED)
    (folder / "world.xml").write_text('<mujoco><worldbody><geom type="plane" size="3 3 .1"/></worldbody></mujoco>')
    return Simulation(load_scene(folder / "world.xml", (RobotSpec(model=str(folder / "robot.xml")),)), seed=1)


def test_the_same_files_in_another_folder_are_the_same_world(tmp_path: Path) -> None:
    here, there = installed(tmp_path / "here"), installed(tmp_path / "some" / "where" / "else")
    assert here.scene.fingerprint == there.scene.fingerprint
    here.advance(0.1)
    there.restore(here.snapshot())
    assert there.digest() == here.digest()


def test_another_mesh_or_texture_of_the_same_name_makes_another_world(tmp_path: Path) -> None:
    worlds = [installed(tmp_path / "a"), installed(tmp_path / "b", length=1.1), installed(tmp_path / "c", shade=90)]
    assert len({world.scene.fingerprint for world in worlds}) == 3


def test_another_option_makes_another_world(tmp_path: Path) -> None:
    file, worlds = tmp_path / "world.xml", []
    for option in ("", '<option gravity="0 0 -1"/>', '<option><flag contact="disable"/></option>', "<visual/>"):
        file.write_text(f'<mujoco>{option}<worldbody><geom size=".1"/></worldbody></mujoco>')
        worlds.append(load_scene(file).fingerprint)
    assert len(set(worlds)) == 3
    assert worlds[0] == worlds[3]
