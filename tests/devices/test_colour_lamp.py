"""Promises about coloured lamps, and what cameras see of them."""

from pathlib import Path

import numpy as np
import pytest

from regraft.bus_schema.encoding import codec
from regraft.bus_schema.messages.devices.signals import Colour
from regraft.bus_schema.messages.sensors import Image, LightLevel
from regraft.bus_schema.messages.world import WorldState
from regraft.sim_service.camera_component import Camera
from regraft.sim_service.cameras.camera import CameraSettings, RenderState
from regraft.sim_service.cameras.renderers import make_camera
from regraft.sim_service.devices.signals.colour_lamp import ColourLamp
from regraft.sim_service.layout.scene import SceneError
from regraft.sim_service.simulation import Simulation
from regraft.testing import Rig

from .worlds import FLOOR, PUCK, device, found, on_bus, robot, simulated, tick, world_on

BODY = PUCK + '<geom name="lamp" size=".02" pos="0 0 .06" rgba=".5 .5 .5 1"/>'
EYE = FLOOR + '<camera name="eye" pos=".3 0 .06" xyaxes="0 1 0 0 0 1" resolution="32 24"/>'


def lamp_robot(folder: Path) -> Simulation:
    """Return a world with a robot that has a lamp, and a camera that looks at it."""
    return simulated(folder, robot(folder, "", [device(ColourLamp)], body=BODY), body=EYE)


def drawn(renderer: str, simulation: Simulation, state: RenderState) -> np.ndarray:
    """Return the picture of a moment."""
    camera = make_camera(renderer, simulation.scene, simulation.placement, CameraSettings("eye"))  # type: ignore[arg-type]
    try:
        return camera.render(state)
    finally:
        camera.close()


def test_every_camera_sees_a_lamp_in_its_colour_in_the_dark_too(tmp_path: Path, renderer: str) -> None:
    simulation = lamp_robot(tmp_path)
    simulation.set_light(0.0)
    found(simulation, ColourLamp).on_colour(Colour(1.0, 0.0, 0.4))
    middle = drawn(renderer, simulation, simulation.render_state())[12, 16]
    assert middle.tolist() == pytest.approx([255, 0, 102], abs=2)


def test_a_lamp_that_is_off_changes_no_picture(tmp_path: Path, renderer: str) -> None:
    with_lamp = lamp_robot(tmp_path)
    state = with_lamp.render_state()
    before = drawn(renderer, with_lamp, RenderState(state.qpos, state.light, state.step))
    lamp = found(with_lamp, ColourLamp)
    for _ in range(2):
        np.testing.assert_array_equal(drawn(renderer, with_lamp, with_lamp.render_state()), before)
        lamp.on_colour(Colour(0.0, 1.0, 0.0))
        assert (drawn(renderer, with_lamp, with_lamp.render_state()) != before).any()
        lamp.on_colour(Colour())


def test_the_world_state_carries_colours_of_lamps_that_shine_alone(tmp_path: Path) -> None:
    with Rig() as rig:
        world = world_on(rig, tmp_path, robot(tmp_path, "one", [device(ColourLamp, "lamp")], body=BODY))
        states = rig.collect("world_state", WorldState)
        tick(rig, world)
        rig.publish("one/colour", Colour(0.0, 1.0, 0.0))
        tick(rig, world)
    assert states[0].colours == ()
    (shown,) = states[1].colours
    assert shown.geom == world.simulation.scene.index("geom", "one/lamp")
    assert (shown.red, shown.green, shown.blue) == (0.0, 1.0, 0.0)
    plain = codec.to_plain(states[0])
    assert list(plain) == ["stamp", "tick", "seed", "model_hash", "positions", "light", "base", "colours"]


def test_a_camera_component_shows_a_lamp(tmp_path: Path) -> None:
    with Rig() as rig:
        parameters = on_bus(tmp_path, robot(tmp_path, "one", [device(ColourLamp, "lamp")], body=BODY), body=EYE)
        world = world_on(rig, tmp_path, robot(tmp_path, "one", [device(ColourLamp, "lamp")], body=BODY), body=EYE)
        how = {"renderer": "ray", "camera": "eye", "width": 32, "height": 24, "rate": 20.0, "full_well": 0.0}
        rig.add(Camera, parameters={**parameters, **how})
        pictures = rig.collect("image", Image)
        rig.publish("light", LightLevel(0.0, 1.0))
        rig.publish("one/colour", Colour(0.0, 0.0, 1.0))
        tick(rig, world, 4)
    assert pictures[-1].pixels[12, 16].tolist() == [0, 0, 255]


def test_a_black_lamp_is_off_and_a_frozen_one_keeps_its_colour(tmp_path: Path) -> None:
    simulation = lamp_robot(tmp_path)
    lamp = found(simulation, ColourLamp)
    lamp.on_colour(Colour(1.0, 0.0, 0.0))
    lamp.kit.failing = "frozen"
    lamp.on_colour(Colour(0.0, 1.0, 0.0))
    assert list(lamp.colours().values()) == [(1.0, 0.0, 0.0)]
    lamp.kit.failing = "black"
    assert lamp.colours() == {}


def test_a_restored_lamp_goes_on_shining(tmp_path: Path) -> None:
    original, successor = lamp_robot(tmp_path), lamp_robot(tmp_path)
    found(original, ColourLamp).on_colour(Colour(1.0, 0.5, 0.0))
    successor.restore(original.snapshot())
    assert successor.render_state().colours == original.render_state().colours != {}


def test_a_geom_that_is_not_there_is_refused(tmp_path: Path) -> None:
    with pytest.raises(SceneError, match="no geom named 'led'"):
        simulated(tmp_path, robot(tmp_path, "", [device(ColourLamp, geom="led")], body=BODY))
