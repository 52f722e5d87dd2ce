"""Draw a world: `python -m sim_service.picture WORLD.xml OUT.png`."""

import argparse
import sys

import cv2
import numpy as np

from sim_service.camera import CameraSettings, RenderState
from sim_service.placement import Placement, PlacementError, draw_placement
from sim_service.renderers import make_camera, probe
from sim_service.scene import SceneError, load_scene


def main(arguments: list[str] | None = None) -> int:
    """Write the picture and return the exit code."""
    parser = argparse.ArgumentParser(prog="python -m sim_service.picture", description="Draw a simulated world.")
    parser.add_argument("world", help="the world's MJCF file")
    parser.add_argument("out", help="the picture file to write (.png or .jpg)")
    parser.add_argument("--seed", type=int, default=None, help="place bodies by this seed (default: as in the file)")
    parser.add_argument("--camera", default="overview", help="which camera of the world draws (default: overview)")
    parser.add_argument("--width", type=int, default=None, help="pixels (default: the camera's)")
    parser.add_argument("--height", type=int, default=None, help="pixels (default: the camera's)")
    options = parser.parse_args(arguments)
    try:
        view = CameraSettings(options.camera, options.width, options.height)
        used = draw(options.world, options.out, options.seed, view)
    except (SceneError, PlacementError, OSError, ValueError) as error:
        print(f"error: {error}", file=sys.stderr)
        return 1
    print(f"wrote {options.out} (renderer: {used})")
    return 0


def draw(world: str, out: str, seed: int | None, view: CameraSettings) -> str:
    """Write a picture of a world and return the name of the renderer.

    Raises:
        SceneError, PlacementError: the world is wrong.
        ValueError: a size is not positive.
        OSError: the picture can't be written.
    """
    scene = load_scene(world)
    placement = Placement({}) if seed is None else draw_placement(scene, seed)
    renderer = probe().renderer
    eye = make_camera(renderer, scene, placement, view)
    qpos = scene.model.qpos0.copy()
    placement.apply(scene, scene.new_model(), qpos)
    try:
        image = eye.render(RenderState(qpos, 1.0, 0))
    finally:
        eye.close()
    try:
        written = cv2.imwrite(out, np.ascontiguousarray(image[:, :, ::-1]))
    except cv2.error as error:
        raise OSError(f"can't write {out}: {error.err}") from error
    if not written:
        raise OSError(f"can't write {out}: is there such a folder?")
    return renderer


if __name__ == "__main__":
    raise SystemExit(main())
