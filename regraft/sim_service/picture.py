"""Draw a world: `python -m regraft.sim_service.picture STACK OUT.png`, or the `WORLD.xml` alone.

Several seeds give one picture, side by side. People stand where their walks begin.

The picture is for people: with shadows, a sky and smooth edges, none of which the robot's own cameras see.
"""

import argparse
import math
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import cv2
import mujoco
import numpy as np
import numpy.typing as npt

from regraft.component.component import class_path, parameter_set
from regraft.component.parameters import ParameterError
from regraft.planar import Pose2D
from regraft.sim_service.cameras.camera import CameraSettings, Image, RenderState, image_size
from regraft.sim_service.cameras.gl_camera import Backend, GLCamera
from regraft.sim_service.cameras.ray_camera import RayCamera
from regraft.sim_service.cameras.renderers import RendererName, probe
from regraft.sim_service.layout.composition import composed
from regraft.sim_service.layout.placement import Placement, PlacementError, draw_placement
from regraft.sim_service.layout.scene import Scene, SceneError, load_scene
from regraft.sim_service.people.crowds import CrowdParameter
from regraft.sim_service.people.walkers import Person, Walker
from regraft.sim_service.robots import RobotSpec
from regraft.sim_service.rooms.loading import load_world
from regraft.sim_service.world import World
from regraft.stack import StackError, load
from regraft.stack.installed import stack_file

FINER = 2
"""Pixels drawn for each pixel of the picture, in either direction: that makes edges smooth."""
SHADOW_MAP = 8192
SHADOW_REACH = 2.0
"""Half the width of the shadow map, in extents of the world."""
APART = 1e-4
"""Metres by which boxes are made to differ in height."""
HORIZON, ZENITH = (0.93, 0.95, 0.97), (0.42, 0.58, 0.76)
LAMP_AT, LAMP_TO = (-3.2, 1.2, 6.5), (0.0, 0.0, 0.0)
LAMP_STRENGTH, OTHERS_STRENGTH, HEADLIGHT_STRENGTH = 0.55, 0.35, 1.25
"""The casting lamp's brightness; shares of their own brightness that the world's lamps and the headlight keep."""


@dataclass(frozen=True, slots=True)
class View:
    """How a world is drawn: by which camera, with its own vertical field of view (degrees) if ``fovy`` is None.

    The groups ``crowd`` of people are present, as by the world's parameter of this name.
    """

    camera: CameraSettings
    fovy: float | None = None
    crowd: str = ""


def main(arguments: list[str] | None = None) -> int:
    """Write the picture and return the exit code."""
    parser = argparse.ArgumentParser(
        prog="python -m regraft.sim_service.picture", description="Draw a simulated world."
    )
    parser.add_argument("world", help="a stack, which has a world with robots, or the MJCF file of a world alone")
    parser.add_argument("out", help="the picture file to write (.png or .jpg)")
    parser.add_argument(
        "--seed", type=int, nargs="+", help="place bodies by this seed, or these (default: as in the file)"
    )
    parser.add_argument("--camera", default="overview", help="which camera of the world draws (default: overview)")
    parser.add_argument("--width", type=int, default=None, help="pixels (default: the camera's)")
    parser.add_argument("--height", type=int, default=None, help="pixels (default: the camera's)")
    parser.add_argument(
        "--fovy", type=float, default=None, help="vertical field of view, degrees (default: the camera's)"
    )
    parser.add_argument("--crowd", default="", help="groups of people that are present (default: none)")
    options = parser.parse_args(arguments)
    try:
        camera = CameraSettings(options.camera, options.width, options.height)
        view = View(camera, options.fovy, options.crowd)
        used = draw(options.world, options.out, options.seed or [None], view)
    except (SceneError, PlacementError, StackError, ParameterError, OSError, ValueError) as error:
        print(f"error: {error}", file=sys.stderr)
        return 1
    print(f"wrote {options.out} (renderer: {used})")
    return 0


def draw(world: str, out: str, seeds: Sequence[int | None], view: View) -> str:
    """Write a picture of a world by each seed, all in one file, and return the name of the renderer.

    Raises:
        SceneError, PlacementError: the world is wrong.
        StackError, ParameterError: the stack is wrong, or has no world, or no person has a group.
        ValueError: a size is not positive, a field of view not between 0 and 180 degrees.
        OSError: the picture can't be written.
    """
    renderer = probe().renderer
    _write(out, _tiled([_drawn(Path(world), seed, view, renderer) for seed in seeds]))
    return renderer


def _drawn(world: Path, seed: int | None, view: View, renderer: RendererName) -> Image:
    scene, people = _scene(world, seed)
    if view.fovy is not None:
        scene = _recompiled(scene, partial(_see, view.camera.name, view.fovy))
    placement = Placement({}) if seed is None else draw_placement(scene, seed)
    width, height = image_size(scene, view.camera)
    eye: RayCamera | Painter
    if renderer == "ray":
        eye = RayCamera(scene, placement, view.camera)
    else:
        finer = CameraSettings(view.camera.name, width * FINER, height * FINER)
        eye = Painter(dressed(scene), placement, finer, renderer)
    try:
        image = eye.render(RenderState(_positions(scene, placement, people, view.crowd), 1.0, 0))
    finally:
        eye.close()
    return np.asarray(cv2.resize(image, (width, height), interpolation=cv2.INTER_AREA), np.uint8)


def _positions(scene: Scene, placement: Placement, people: Sequence[Person], crowd: str) -> npt.NDArray[np.float64]:
    """Return where everything is: what is placed, the robots, and people where their walks begin."""
    present = CrowdParameter(people).checked(crowd).split()
    model = scene.new_model()
    data = mujoco.MjData(model)
    placement.apply(scene, model, data.qpos)
    mujoco.mj_kinematics(model, data)
    bodies = [scene.index("body", robot.body) for robot in scene.robots]
    robots = [Pose2D(float(data.xpos[body][0]), float(data.xpos[body][1]), 0.0) for body in bodies]
    for person in people:
        walker = Walker(scene, person)
        walker.begin(data, robots)
        if person.group in present:
            walker.set_present(data, True)
            walker.move(data, 0.0, robots)
    return np.array(data.qpos, np.float64)


def _tiled(images: Sequence[Image]) -> Image:
    """Return images of one size as one, in about as many rows as columns; what is left over is white."""
    columns = math.ceil(math.sqrt(len(images)))
    rest = [np.full_like(images[0], 255)] * (-len(images) % columns)
    tiles = [*images, *rest]
    rows = [np.hstack(tiles[first : first + columns]) for first in range(0, len(tiles), columns)]
    return np.vstack(rows)


def _scene(named: Path, seed: int | None) -> tuple[Scene, Sequence[Person]]:
    """Return the world of a stack with robots and people, or of an MJCF file alone; without a seed as it is there."""
    if named.suffix == ".xml":
        return _loaded(named, (), seed), ()
    stack = load(stack_file(named))
    for spec in stack.architecture.components.values():
        if spec.cls == class_path(World):
            values = parameter_set(World, spec.parameters).values
            return _loaded(values["file"], values["robots"], seed), values["people"]
    raise SceneError(f"{stack.file}: has no component of the class {class_path(World)}")


def _loaded(file: str | Path, robots: Sequence[RobotSpec], seed: int | None) -> Scene:
    return load_scene(file, robots) if seed is None else load_world(file, robots, seed)


def dressed(scene: Scene) -> Scene:
    """Return the world with a sky above it and a lamp that casts shadows."""
    return _recompiled(scene, _dress)


def _recompiled(scene: Scene, change: Callable[[mujoco.MjSpec], None]) -> Scene:
    """Return the world with a further change to its file."""

    def changed(spec: mujoco.MjSpec) -> None:
        scene.change(spec)
        change(spec)

    made = composed(scene.path, scene.robots, changed)
    return Scene(scene.path, made.model, "", scene.robots, changed, made.parts)


def _see(camera: str, fovy: float, spec: mujoco.MjSpec) -> None:
    """Have a camera see a vertical angle (degrees)."""
    if not 0.0 < fovy < 180.0:
        raise ValueError(f"camera {camera!r} needs a field of view between 0 and 180 degrees, not {fovy:g}")
    seeing = spec.camera(camera)
    if seeing is not None:  # a camera that is not there is reported where its size is asked for
        seeing.fovy = fovy


def _dress(spec: mujoco.MjSpec) -> None:
    spec.visual.quality.shadowsize = SHADOW_MAP
    spec.visual.headlight.ambient = np.asarray(spec.visual.headlight.ambient) * HEADLIGHT_STRENGTH
    spec.add_texture(
        name="sky",
        type=mujoco.mjtTexture.mjTEXTURE_SKYBOX,
        builtin=mujoco.mjtBuiltin.mjBUILTIN_GRADIENT,
        width=256,
        height=1536,
        rgb1=ZENITH,
        rgb2=HORIZON,
    )
    spec.visual.map.shadowclip = SHADOW_REACH
    for number, geom in enumerate(spec.geoms):
        if geom.type == mujoco.mjtGeom.mjGEOM_BOX:
            # Where faces of two boxes coincide, the casting lamp would light both, one through the other.
            geom.size = np.asarray(geom.size) + np.array([0.0, 0.0, number * APART])
    for lamp in spec.lights:
        lamp.diffuse = np.asarray(lamp.diffuse) * OTHERS_STRENGTH
    spec.worldbody.add_light(
        name="sun",
        type=mujoco.mjtLightType.mjLIGHT_DIRECTIONAL,
        pos=LAMP_AT,
        dir=np.subtract(LAMP_TO, LAMP_AT),
        diffuse=[LAMP_STRENGTH] * 3,
        castshadow=True,
    )


class Painter(GLCamera):
    """A camera that takes its time: it draws shadows."""

    def __init__(self, scene: Scene, placement: Placement, settings: CameraSettings, backend: Backend) -> None:
        super().__init__(scene, placement, settings, backend)
        self._picture.flags[mujoco.mjtRndFlag.mjRND_SHADOW] = 1


def _write(out: str, image: Image) -> None:
    try:
        written = cv2.imwrite(out, np.ascontiguousarray(image[:, :, ::-1]))
    except cv2.error as error:
        raise OSError(f"can't write {out}: {error.err}") from error
    if not written:
        raise OSError(f"can't write {out}: is there such a folder?")


if __name__ == "__main__":
    raise SystemExit(main())
