"""Promises about depth cameras."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from regraft.bus_schema.messages.sensors import DepthImage
from regraft.bus_schema.model.lifecycle import State, Transition
from regraft.component.parameters import ParameterError
from regraft.runtime.lifecycle.lifecycle import TransitionFailed
from regraft.sim_service.cameras.camera import CameraSettings
from regraft.sim_service.cameras.renderers import RendererName, make_camera
from regraft.sim_service.depth_camera import DepthCamera
from regraft.testing import Rig

from .worlds import FLOOR, on_bus, simulated, tick, world_on

ROOM = f"""{FLOOR}<camera name="eye" pos="0 0 1" xyaxes="0 -1 0 0 0 1" fovy="60" resolution="40 30"/>
<body name="wall" pos="2.05 0 1"><geom type="box" size=".05 5 5"/></body>
<body name="post" pos="1 0 1"><geom type="box" size=".05 .05 5"/></body>"""
HOW: dict[str, Any] = {"camera": "eye", "width": 40, "height": 30, "rate": 20.0}


def test_depths_are_those_along_the_optical_axis(tmp_path: Path, renderer: RendererName) -> None:
    simulation = simulated(tmp_path, body=ROOM)
    camera = make_camera(renderer, simulation.scene, simulation.placement, CameraSettings("eye"))
    depths = camera.depths(simulation.render_state())
    camera.close()
    assert depths.shape == (30, 40)
    assert depths[15, 20] == pytest.approx(0.95, abs=2e-3)
    for column in (2, 10, 30, 38):  # a wall square to the axis is equally deep everywhere
        assert depths[12, column] == pytest.approx(2.0, abs=2e-3)


def test_nothing_is_infinitely_deep(tmp_path: Path, renderer: RendererName) -> None:
    eye = '<camera name="eye" pos="0 0 1" xyaxes="0 -1 0 0 0 1" resolution="40 30"/>'
    simulation = simulated(tmp_path, body=FLOOR + eye)
    camera = make_camera(renderer, simulation.scene, simulation.placement, CameraSettings("eye"))
    depths = camera.depths(simulation.render_state())
    camera.close()
    assert np.isinf(depths[0]).all()
    assert np.isfinite(depths[-1]).all()


def pictures(folder: Path, count: int = 1, **how: Any) -> list[DepthImage]:
    """Return messages of a depth camera in the room."""
    with Rig(seed=3) as rig:
        world = world_on(rig, folder, body=ROOM)
        parameters = {**on_bus(folder, body=ROOM), **HOW, "renderer": "ray", **how}
        rig.add(DepthCamera, parameters=parameters)
        collected = rig.collect("depth", DepthImage)
        for _ in range(2 * count + 2):
            tick(rig, world)
    return collected


def test_a_message_says_what_is_near_far_and_out_of_range(tmp_path: Path) -> None:
    image = pictures(tmp_path, noise=0.0, range_min=1.0, range_max=3.0)[-1]
    assert image.depths[15, 20] == -np.inf
    assert image.depths[12, 2] == pytest.approx(2.0)
    assert pictures(tmp_path, noise=0.0, range_min=0.1, range_max=1.5)[-1].depths[12, 2] == np.inf
    assert (image.range_min, image.range_max, image.pose_frame) == (1.0, 3.0, "map")


def test_noise_grows_with_the_square_of_the_depth_and_is_repeatable(tmp_path: Path) -> None:
    images = pictures(tmp_path, 8, noise=0.01)
    again = pictures(tmp_path, 8, noise=0.01)
    walls = np.array([image.depths[2:12, [2, 10, 30, 38]] for image in images])
    posts = np.array([image.depths[:, 20] for image in images])
    assert np.std(walls) == pytest.approx(0.01 * 2.0**2, rel=0.1)
    assert np.std(posts) == pytest.approx(0.01 * 0.95**2, rel=0.15)
    for one, other in zip(images, again, strict=True):
        np.testing.assert_array_equal(one.depths, other.depths)


def test_each_failure_shows_in_its_way(tmp_path: Path) -> None:
    assert (pictures(tmp_path, failure="black")[-1].depths == np.inf).all()
    assert pictures(tmp_path, failure="silent") == []
    frozen = pictures(tmp_path, 3, failures=[{"at": 0.15, "failure": "frozen"}])
    np.testing.assert_array_equal(frozen[-1].depths, frozen[-2].depths)
    assert frozen[-1].stamp > frozen[-2].stamp


def test_a_camera_that_measures_farther_at_least_than_at_most_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ParameterError, match=r"range_max: 0\.4 m: must be above range_min, 0\.5 m"):
        DepthCamera.check_parameters({"range_min": 0.5, "range_max": 0.4}, 3)
    parameters = {**on_bus(tmp_path, body=ROOM), **HOW, "range_max": 0.4}
    with Rig(seed=3) as rig:
        rig.add(DepthCamera, "eye", parameters, state=State.UNCONFIGURED)
        with pytest.raises(TransitionFailed, match="must be above range_min"):
            rig.transition("eye", Transition.CONFIGURE)
        assert len(rig.take_faults()) == 1
