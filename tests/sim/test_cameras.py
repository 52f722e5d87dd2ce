"""Promises about cameras, light and renderers."""

import math
from pathlib import Path

import cv2
import numpy as np
import pytest

from regraft.planar import Pose2D
from regraft.sim_service import picture
from regraft.sim_service.cameras.camera import CameraSettings, Image, SensorNoise
from regraft.sim_service.cameras.camera_mount import CameraMount, camera_mount
from regraft.sim_service.cameras.ray_camera import RayCamera
from regraft.sim_service.cameras.renderers import FORCE, RendererName, make_camera, probe
from regraft.sim_service.layout.placement import Placement
from regraft.sim_service.layout.scene import SceneError, load_scene
from regraft.sim_service.robots import Place, RobotSpec
from regraft.sim_service.simulation import Simulation
from tests.support.machine.renderers import renderers, without_opengl
from tests.support.worlds import waffle

from .worlds import FROG, OUT_OF_THE_WAY, frog

SMALL = (160, 120)


def before_the_hydrant() -> Simulation:
    """Return FROG with the robot looking at the hydrant from 0.9 m."""
    poses = {**OUT_OF_THE_WAY, "hydrant": Pose2D(0.5, -1.0, 0.0), "base": Pose2D(-0.4, -1.0, 0.0)}
    return Simulation(frog(), 1, placement=Placement(poses))


def render(simulation: Simulation, renderer: RendererName, settings: CameraSettings) -> Image:
    """Return one picture of the simulation's present."""
    camera = make_camera(renderer, simulation.scene, simulation.placement, settings)
    try:
        return camera.render(simulation.render_state())
    finally:
        camera.close()


def hydrant_pixels(image: Image) -> np.ndarray[tuple[int, int], np.dtype[np.bool_]]:
    """Return which pixels are saturated red."""
    hsv = cv2.cvtColor(image, cv2.COLOR_RGB2HSV)
    hue, saturation, value = hsv[..., 0], hsv[..., 1], hsv[..., 2]
    return ((hue < 8) | (hue > 172)) & (saturation > 110) & (value > 45)


def test_hydrant_ahead_is_seen_whole_and_red(renderer: RendererName) -> None:
    image = render(before_the_hydrant(), renderer, CameraSettings("camera"))
    assert image.shape == (240, 320, 3)
    assert image.dtype == np.uint8
    rows, columns = np.nonzero(hydrant_pixels(image))
    assert len(rows) > 3000
    assert abs(float(columns.mean()) - 160.0) < 15.0
    assert rows.min() > 0
    assert rows.max() < 239


def test_darkness_blinds_the_robot_but_not_the_corner_camera(renderer: RendererName) -> None:
    simulation = before_the_hydrant()
    robot = CameraSettings("camera", *SMALL)
    corner = CameraSettings("corner_camera", *SMALL, always_lit=True)
    lit_corner = render(simulation, renderer, corner)
    brightness = []
    for level in (1.0, 0.5, 0.0):
        simulation.set_light(level)
        brightness.append(float(render(simulation, renderer, robot).mean()))
        np.testing.assert_array_equal(render(simulation, renderer, corner), lit_corner)
    assert brightness[0] > 60.0
    assert brightness[1] == pytest.approx(brightness[0] / 2.0, rel=0.1)
    assert brightness[2] < 1.0


def test_all_renderers_show_the_same_colours() -> None:
    simulation = before_the_hydrant()
    pictures = [render(simulation, renderer, CameraSettings("camera", *SMALL)) for renderer in renderers()]
    means = [image[hydrant_pixels(image)].mean(axis=0) for image in pictures]
    for image, mean in zip(pictures, means, strict=True):
        np.testing.assert_allclose(mean, means[0], atol=4.0)
        np.testing.assert_allclose(image.mean(axis=(0, 1)), pictures[0].mean(axis=(0, 1)), atol=4.0)
    assert 80.0 < means[0][0] < 200.0
    assert means[0][1] < 20.0


SHELL = """<mujoco><worldbody><camera name="eye" xyaxes="0 -1 0 0 0 1"/>
<geom name="hull" type="box" pos="1 0 0" size=".1 2 2" rgba="1 0 0 1" group="3"/>
<geom name="visual" type="box" pos="2 0 0" size=".1 4 4" rgba="0 1 0 1" group="2"/></worldbody></mujoco>"""


def test_no_renderer_shows_shapes_of_the_groups_that_opengl_hides(tmp_path: Path) -> None:
    file = tmp_path / "world.xml"
    file.write_text(SHELL)
    simulation = Simulation(load_scene(file), 1)
    for renderer in renderers():
        red, green, _ = render(simulation, renderer, CameraSettings("eye", *SMALL)).mean(axis=(0, 1))
        assert green > 2.0 * red  # OpenGL's highlights are white
        camera = make_camera(renderer, simulation.scene, simulation.placement, CameraSettings("eye", *SMALL))
        np.testing.assert_allclose(camera.depths(simulation.render_state()), 1.9, rtol=1e-2)
        camera.close()


def test_noise_repeats_for_the_same_seed_and_moment_only() -> None:
    simulation = before_the_hydrant()
    settings = CameraSettings("camera", *SMALL, noise=SensorNoise(), seed=3)
    camera = RayCamera(simulation.scene, simulation.placement, settings)
    other = RayCamera(simulation.scene, simulation.placement, CameraSettings("camera", *SMALL, noise=SensorNoise()))
    first = camera.render(simulation.render_state())
    np.testing.assert_array_equal(first, camera.render(simulation.render_state()))
    assert (first != other.render(simulation.render_state())).mean() > 0.3
    simulation.advance(0.05)
    assert (first != camera.render(simulation.render_state())).mean() > 0.3


def test_noise_hides_the_hydrant_in_the_dark() -> None:
    simulation = before_the_hydrant()
    settings = CameraSettings("camera", *SMALL, noise=SensorNoise())
    lit = int(hydrant_pixels(render(simulation, "ray", settings)).sum())
    simulation.set_light(0.15)
    assert int(hydrant_pixels(render(simulation, "ray", settings)).sum()) < lit / 20


def test_moved_robot_sees_from_where_it_is() -> None:
    simulation = before_the_hydrant()
    poses = dict(simulation.placement.poses)
    turned = Simulation(frog(), 1, placement=Placement({**poses, "base": Pose2D(-0.4, -1.0, math.pi)}))
    camera = RayCamera(simulation.scene, simulation.placement, CameraSettings("camera", *SMALL))
    assert hydrant_pixels(camera.render(simulation.render_state())).any()
    assert not hydrant_pixels(camera.render(turned.render_state())).any()


def test_shadow_darkens_the_floor() -> None:
    simulation = before_the_hydrant()
    settings = CameraSettings("overview", *SMALL)
    plain = RayCamera(simulation.scene, simulation.placement, settings).render(simulation.render_state())
    shadowed = RayCamera(simulation.scene, simulation.placement, settings, shadows=True)
    image = shadowed.render(simulation.render_state())
    assert (image.astype(int) <= plain.astype(int)).all()
    assert image.mean() < plain.mean() - 0.5


def test_unknown_camera_is_named() -> None:
    with pytest.raises(SceneError, match="no camera named 'eye'"):
        RayCamera(frog(), Placement({}), CameraSettings("eye"))


MAST = """<mujoco><worldbody>
<body name="table" pos="0 0 .5"><body name="arm/base"><body name="hand" pos=".3 0 0">
<joint axis="0 0 1"/><geom size=".05"/><camera name="arm/hand"/></body></body></body>
<body name="mast" pos="2 1 2"><joint name="pan" axis="0 0 1"/><geom size=".1"/><camera name="watch"/></body>
<camera name="corner"/></worldbody></mujoco>"""


def mounted(folder: Path, camera: str) -> CameraMount:
    """Return where a camera sits in a world with a camera on a mast that turns, an arm on a table, and a Waffle."""
    file = folder / "world.xml"
    file.write_text(MAST)
    scene = load_scene(file, (RobotSpec("arm"), waffle("rescuer", Place(0.0, -1.0, 1.0))))
    return camera_mount(scene, Placement({}), camera)


@pytest.mark.parametrize(
    ("camera", "frame", "x"),
    [("rescuer/camera", "rescuer/base_link", 0.073), ("arm/hand", "arm/base_link", 0.3), ("corner", "map", 0.0)],
)
def test_a_camera_is_in_the_frame_of_the_robot_that_carries_it(
    tmp_path: Path, camera: str, frame: str, x: float
) -> None:
    mount = mounted(tmp_path, camera)
    assert mount.frame == frame
    assert mount.pose.x == pytest.approx(x, abs=1e-3)


def test_a_camera_on_a_thing_that_moves_and_is_no_robot_is_refused_by_name(tmp_path: Path) -> None:
    with pytest.raises(SceneError, match="the camera 'watch' is carried by 'mast', which moves and is no robot"):
        mounted(tmp_path, "watch")


def test_the_environment_forces_a_renderer(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(FORCE, "ray")
    assert probe().renderer == "ray"


def test_a_machine_without_opengl_gets_the_ray_camera_and_is_told_what_to_install(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv(FORCE, raising=False)
    monkeypatch.setenv("LD_LIBRARY_PATH", without_opengl(tmp_path / "none")["LD_LIBRARY_PATH"])
    found = probe()
    assert found.renderer == "ray"
    assert found.missing == ("egl", "osmesa")
    assert [name for name, _ in found.reasons] == ["egl", "osmesa", "ray"]
    notice = found.notice()
    assert notice is not None
    assert "libEGL.so.1 and libOSMesa.so.8 cannot be loaded" in notice
    assert "apt-get install libegl1" in notice


def test_an_interpreter_that_cannot_be_started_gives_the_ray_camera(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv(FORCE, raising=False)
    monkeypatch.setattr("sys.executable", "/nonexistent/python")
    found = probe()
    assert found.renderer == "ray"
    assert found.missing == ()
    assert "egl: could not be tried" in (found.notice() or "")


def test_a_forced_renderer_needs_no_notice(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(FORCE, "ray")
    assert probe().notice() is None


def test_picture_command_writes_a_picture(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(FORCE, "ray")
    out = tmp_path / "room.png"
    assert picture.main([str(FROG.parent), str(out), "--seed", "3", "--width", "200", "--height", "150"]) == 0
    image = cv2.imread(str(out))
    assert image is not None
    assert image.shape == (150, 200, 3)
    assert image.std() > 20.0


def test_picture_command_explains_a_missing_world(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert picture.main([str(tmp_path / "none.xml"), str(tmp_path / "out.png")]) == 1
    assert "no such world file" in capsys.readouterr().err


@pytest.mark.parametrize("out", ["room.unknown", "no_such_folder/room.png"])
def test_picture_command_explains_a_file_it_cannot_write(
    out: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv(FORCE, "ray")
    assert picture.main([str(FROG), str(tmp_path / out), "--width", "40", "--height", "30"]) == 1
    assert "can't write" in capsys.readouterr().err
