"""Promises of simulated cameras as components."""

import math
from typing import Any

import numpy as np
import pytest

from regraft.bus_schema.encoding import codec
from regraft.bus_schema.messages.health import Diagnostic, Level
from regraft.bus_schema.messages.sensors import Image, LightLevel
from regraft.bus_schema.messages.world import WorldState
from regraft.bus_schema.model.lifecycle import State, Transition
from regraft.sim_service import world_camera
from regraft.sim_service.camera_component import Camera
from regraft.sim_service.cameras import renderers
from regraft.sim_service.cameras.renderers import RendererName
from regraft.testing import Rig
from tests.support.worlds import FROG_WORLD

from .rigs import run, world_on


def camera_on(rig: Rig, renderer: str = "ray", name: str = "camera", **parameters: object) -> Camera:
    given = {**FROG_WORLD, "renderer": renderer, **parameters}
    return rig.add(Camera, name, given, {"image": f"{name}/image"})


def test_pictures_come_at_the_renderers_pace_and_show_their_tick(renderer: RendererName) -> None:
    with Rig(seed=3) as rig:
        world = world_on(rig)
        camera_on(rig, renderer)
        images = rig.collect("camera/image", Image)
        run(rig, world, 2.0)
        status = rig.runtimes["camera"].reporter.status
    rate, shape = (2, (120, 160, 3)) if renderer == "ray" else (5, (240, 320, 3))
    assert len(images) == 2 * rate
    assert [round(image.stamp, 3) for image in images[:2]] == [round(1 / rate, 3), round(2 / rate, 3)]
    assert images[0].pixels.shape == shape
    assert images[0].pixels.std() > 10.0
    assert status.detail == f"renders {shape[1]}x{shape[0]} on {renderer}"
    assert status.values == {"renderer": renderer}


def test_nothing_is_rendered_while_nobody_looks(monkeypatch: pytest.MonkeyPatch) -> None:
    rendered = []
    make = renderers.make_camera

    def counting(*arguments: Any) -> Any:
        eye = make(*arguments)
        draw = eye.render
        eye.render = lambda state: rendered.append(state) or draw(state)  # type: ignore[method-assign, func-returns-value]
        return eye

    monkeypatch.setattr(world_camera, "make_camera", counting)
    with Rig(seed=3) as rig:
        world = world_on(rig)
        camera_on(rig)
        run(rig, world, 2.0)
        assert not rendered
        rig.collect("camera/image", Image)
        run(rig, world, 2.0)
        assert len(rendered) == 4


def test_the_rate_can_be_changed_while_it_runs() -> None:
    with Rig(seed=3) as rig:
        world = world_on(rig)
        camera_on(rig, rate=1.0)
        images = rig.collect("camera/image", Image)
        run(rig, world, 2.0)
        assert len(images) == 2
        rig.runtimes["camera"].parameters.set({"rate": 4.0})
        run(rig, world, 3.0)
        # The picture that was already due at the old rate is the last of its kind.
        assert len(images) == 2 + 1 + 8


def test_a_picture_says_where_its_camera_is() -> None:
    with Rig(seed=3) as rig:
        world = world_on(rig)
        camera_on(rig)
        camera_on(rig, name="corner_camera", camera="corner_camera", always_lit=True)
        near = rig.collect("camera/image", Image)
        far = rig.collect("corner_camera/image", Image)
        run(rig, world, 1.0)
    assert (near[0].frame, near[0].pose_frame) == ("camera_optical", "base_link")
    assert near[0].pose.position.z == pytest.approx(0.085)
    assert near[0].pose.yaw == pytest.approx(0.0, abs=1e-6)
    assert far[0].pose_frame == "map"
    assert far[0].pose.yaw == pytest.approx(0.648, abs=1e-3)
    assert far[0].horizontal_field_of_view == pytest.approx(1.047, abs=1e-3)
    assert math.isclose(far[0].pose.x, -2.427, abs_tol=1e-3)


def test_darkness_blinds_the_robots_camera_but_not_the_one_in_the_corner() -> None:
    with Rig(seed=3) as rig:
        world = world_on(rig)
        camera_on(rig, full_well=0.0)
        camera_on(rig, name="corner_camera", camera="corner_camera", always_lit=True)
        near = rig.collect("camera/image", Image)
        far = rig.collect("corner_camera/image", Image)
        rig.publish("light", LightLevel(0.0, 1.0))
        run(rig, world, 0.5)
    assert near[0].pixels.max() <= 1
    assert far[0].pixels.mean() > 30.0


def test_equal_runs_give_equal_pictures() -> None:
    pictures = []
    for _ in range(2):
        with Rig(seed=3) as rig:
            world = world_on(rig)
            camera_on(rig)
            images = rig.collect("camera/image", Image)
            run(rig, world, 1.0)
            pictures.append([image.pixels for image in images])
    np.testing.assert_array_equal(pictures[0], pictures[1])
    assert (pictures[0][0] != pictures[0][1]).any()


def diagnostics_of(rig: Rig) -> list[Diagnostic]:
    """Return the list of the diagnostics from now on."""
    found: list[Diagnostic] = []
    rig.bus.subscribe(rig.keys.diagnostics, lambda sample: found.append(codec.decode(sample.payload, Diagnostic)))
    return found


def test_a_foreign_world_is_not_drawn_and_the_camera_says_so_once() -> None:
    with Rig(seed=3) as rig, Rig(seed=4) as other:
        diagnostics = diagnostics_of(rig)
        camera_on(rig)
        images = rig.collect("camera/image", Image)
        states = other.collect("world_state", WorldState)
        run(other, world_on(other), 0.1)
        rig.publish("world_state", states[0])
        rig.advance(3.0)
    assert not images
    assert len(diagnostics) == 1
    assert diagnostics[0].level is Level.ERROR
    assert "seed 4" in diagnostics[0].text


def test_a_camera_whose_own_world_comes_after_a_foreign_one_reports_that_it_draws_it() -> None:
    with Rig(seed=3) as rig, Rig(seed=4) as other:
        states = other.collect("world_state", WorldState)
        run(other, world_on(other), 0.1)
        diagnostics = diagnostics_of(rig)
        world = world_on(rig)
        camera_on(rig)
        images = rig.collect("camera/image", Image)
        rig.publish("world_state", states[0])
        rig.advance(1.0)
        assert [each.level for each in diagnostics] == [Level.ERROR]
        run(rig, world, 2.0)
    assert images
    assert [(each.subject, each.level) for each in diagnostics[1:]] == [("world_state", Level.OK)]


@pytest.mark.parametrize("again", [False, True])
def test_a_camera_that_draws_again_reports_that_it_is_well(monkeypatch: pytest.MonkeyPatch, again: bool) -> None:
    troubles = iter([True, True, False, False] if again else [True, False, False, False])
    make = renderers.make_camera

    def failing(*arguments: Any) -> Any:
        eye = make(*arguments)
        draw = eye.render

        def render(state: Any) -> Any:
            if next(troubles, False):
                raise LookupError("the moment is gone")
            return draw(state)

        monkeypatch.setattr(eye, "render", render)
        return eye

    monkeypatch.setattr(world_camera, "make_camera", failing)
    with Rig(seed=3) as rig:
        diagnostics = diagnostics_of(rig)
        world = world_on(rig)
        camera_on(rig)
        images = rig.collect("camera/image", Image)
        run(rig, world, 3.0)
        rig.take_faults()
    assert len(images) == 5 - again
    assert {each.subject for each in diagnostics} == {"rendering"}
    assert [each.level for each in diagnostics] == [Level.ERROR] * (1 + again) + [Level.OK]


def test_a_deactivated_camera_takes_no_pictures_and_goes_on_when_activated() -> None:
    with Rig(seed=3) as rig:
        world = world_on(rig)
        camera_on(rig)
        images = rig.collect("camera/image", Image)
        run(rig, world, 1.0)
        rig.transition("camera", Transition.DEACTIVATE)
        run(rig, world, 1.0)
        assert len(images) == 2
        rig.transition("camera", Transition.ACTIVATE)
        run(rig, world, 1.0)
        assert len(images) == 4
        rig.transition("camera", Transition.DEACTIVATE)
        rig.transition("camera", Transition.CLEANUP)
        assert rig.state("camera") is State.UNCONFIGURED
