"""The base of cameras of a simulated world, as components."""

from __future__ import annotations

from abc import abstractmethod
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from typing import Any, ClassVar

import cv2

from regraft import Component, Input, Parameter, Quality, Records
from regraft.bus_schema.annotations import PlainValue
from regraft.bus_schema.messages.geometry import Pose
from regraft.bus_schema.messages.health import Level
from regraft.bus_schema.messages.world import WorldState
from regraft.bus_schema.model.description import Resources
from regraft.sim_service.cameras import renderers
from regraft.sim_service.cameras.camera import Camera as Eye
from regraft.sim_service.cameras.camera import CameraSettings, RenderState
from regraft.sim_service.cameras.camera_mount import camera_mount
from regraft.sim_service.cameras.renderers import Probe, RendererName, make_camera
from regraft.sim_service.devices.core.failure_schedule import (
    BLACK,
    CAMERA_FAILURES,
    FROZEN,
    NONE,
    SILENT,
    CameraFails,
    Schedule,
)
from regraft.sim_service.layout.identity import world_hash
from regraft.sim_service.layout.placement import draw_placement
from regraft.sim_service.robots import RobotSpec
from regraft.sim_service.rooms.loading import load_world

GL_DEFAULTS = (320, 240, 5.0)
RAY_DEFAULTS = (160, 120, 2.0)
"""Width, height (pixels) and rate (Hz): the ray camera takes about ten times as long for a pixel."""
RECENT = 5.0
"""s over which the rate is taken."""
LISTENING = 0.012
"""Share of a core that hearing of 20 world states a second takes."""
DRAWING = {"egl": (1.3e-3, 1.7e-8), "osmesa": (1.3e-3, 1.7e-8), "ray": (0.2e-3, 4.5e-7)}
"""s of a core for a picture of FROG's room, and for each of its pixels, by renderer."""


def usual_of(renderer: str) -> tuple[int, int, float]:
    """Return width and height (pixels) and rate (Hz) that a renderer does with ease."""
    return RAY_DEFAULTS if renderer == "ray" else GL_DEFAULTS


Moment = Callable[[], WorldState | None]
"""Returns what the world was like at a moment, None if that is not to be had any more."""


@cache
def probed() -> Probe:
    """Find out which renderer works, once in this process and all that are forked from it."""
    return renderers.probe()


@dataclass(frozen=True, slots=True)
class View:
    """When and from where a picture was taken, in the fields and the order of its message."""

    stamp: float
    frame: str
    pose_frame: str
    pose: Pose
    horizontal_field_of_view: float


class WorldCamera(Component):
    """Takes the pictures of one camera of the world, when they are due and somebody wants them.

    It draws those that a reader opens, or all if somebody subscribes. A picture shows the tick it was taken in.
    ``width``, ``height`` and ``rate`` of 0 are what the renderer does with ease. That is 320 x 240 at 5 Hz with
    OpenGL, 160 x 120 at 2 Hz with rays.

    The parameter ``failure`` makes it fail at once. The schedule ``failures`` makes it fail by the clock, while the
    parameter is none. A subclass has the output and takes the pictures.
    """

    pictures: ClassVar[str]
    """The name of the output."""

    handler_timeout = 2.0
    resources = Resources(cpu=0.05, memory=130.0)

    file = Parameter("", "the world's MJCF file, the same as the world's", unit="path", exists=True, read_only=True)
    robots = Records(RobotSpec, "the world's robots, the same as the world's")
    robot = Parameter(
        "", "the robot that has it in its MJCF; empty: the world or the robot without a name", read_only=True
    )
    camera = Parameter("camera", "the camera's name in the MJCF file", read_only=True)
    renderer = Parameter("auto", "what draws", choices=("auto", "egl", "osmesa", "ray"), read_only=True)
    width = Parameter(0, "of a picture; 0: the renderer's default", minimum=0, maximum=4096, unit="px", read_only=True)
    height = Parameter(0, "of a picture; 0: the renderer's default", minimum=0, maximum=4096, unit="px", read_only=True)
    rate = Parameter(0.0, "pictures per second; 0: the renderer's default", minimum=0.0, maximum=60.0, unit="Hz")
    failure = Parameter(NONE, "how the camera fails now", choices=CAMERA_FAILURES)
    failures = Records(CameraFails, "when it fails and works again, while 'failure' is none", in_order_of="at")

    picture_rate = Quality(
        "of the pictures, if somebody wants them", unit="Hz", better="higher", minimum=0.0, functional=True, name="rate"
    )
    cpu = Quality("share of a core", better="lower", minimum=0.0, measured=False)

    world_state = Input(WorldState, latest_only=True, on_demand=True, description="the tick to draw")

    _eye: Eye | None = None
    _in_trouble = False
    """Whether the last picture could not be made."""
    _foreign = ""
    """The hash of the world that runs, where that is another than in the file."""

    @classmethod
    def preload(cls) -> str | None:
        """Find out which renderer works, before processes are forked; return what OpenGL lacks here."""
        return probed().notice()

    @classmethod
    def estimate(cls, parameters: dict[str, PlainValue], context: dict[str, PlainValue]) -> dict[str, float]:
        """Return the ``rate`` (Hz) of the pictures, if somebody wants them, and the ``cpu`` (share of a core)."""
        wanted = str(parameters.get("renderer", cls.renderer.default))
        renderer = probed().renderer if wanted == "auto" else wanted
        width, height, rate = (
            float(parameters.get(name) or usual)
            for name, usual in zip(("width", "height", "rate"), usual_of(renderer), strict=True)
        )
        picture, pixel = DRAWING[renderer]
        return {"rate": rate, "cpu": LISTENING + rate * (picture + pixel * width * height)}

    def on_configure(self) -> None:
        """Load the world and get the renderer ready; raises SceneError."""
        if not self.file:
            raise ValueError("the parameter 'file' must name the world's MJCF file")
        cv2.setNumThreads(1)  # the other cores are for the other components
        self._schedule = Schedule(self.failures)
        self._failing = NONE
        self._shown: Moment | None = None
        self._knows_world = False
        self._taken: deque[float] = deque()
        scene = load_world(self.file, self.robots, self.kit.seed)
        placement = draw_placement(scene, self.kit.seed)
        renderer = self._choose_renderer()
        width, height, self._default_rate = usual_of(renderer)
        self._size = (self.width or width, self.height or height)
        camera = f"{self.robot}/{self.camera}" if self.robot else self.camera
        settings = self.settings(CameraSettings(camera, *self._size, seed=self.kit.seed))
        mount = camera_mount(scene, placement, camera)
        self._view = (
            f"{self.kit.name.replace('.', '/')}_optical",
            mount.frame,
            mount.pose,
            mount.horizontal_field_of_view(*self._size),
        )
        self._hash = world_hash(scene, placement)
        self._eye = make_camera(renderer, scene, placement, settings)
        self.kit.set_status_text(f"renders {self._size[0]}x{self._size[1]} on {renderer}", renderer=renderer)

    def _choose_renderer(self) -> RendererName:
        for name in renderers.NAMES:
            if self.renderer == name:
                return name
        return probed().renderer

    def on_activate(self) -> None:
        """Begin to take pictures."""
        self._active_since = self.kit.now()
        self._taken.clear()
        self.kit.spawn(self._take_pictures(), "take pictures")

    async def _take_pictures(self) -> None:
        due = self.kit.now()
        while True:
            due = max(due + 1.0 / (self.rate or self._default_rate), self.kit.now())
            await self.kit.sleep(due - self.kit.now())
            try:
                self._take_picture()
            except Exception as error:
                self._note_trouble(error)

    def _take_picture(self) -> None:
        failure = self._note_failure()
        output = getattr(self, self.pictures)
        moment = self.world_state.opener() if output.wanted and failure != SILENT else None
        if moment is None or self._eye is None or not (self._knows_world or self._is_ours(moment())):
            return
        eye, shown = self._eye, self._moment_shown(moment, failure)
        self._note_rate()
        output.publish_deferred(lambda: self._picture(eye, moment, shown))

    def _moment_shown(self, moment: Moment, failure: str) -> Moment | None:
        """Return the moment that the picture shows: a frozen camera's last one, None if the picture is black."""
        if failure == BLACK:
            return None
        if failure != FROZEN:
            self._shown = moment
            return moment
        # It is opened now: the world does not keep it for as long as a camera may be frozen.
        state = (self._shown() if self._shown is not None else None) or moment()
        self._shown = lambda: state
        return self._shown

    def _picture(self, eye: Eye, moment: Moment, shown: Moment | None) -> Any:
        try:
            picture = self.message(View(self._state(moment).stamp, *self._view), self._pixels(eye, shown))
        except Exception as error:
            self._note_trouble(error)
            raise
        if self._in_trouble:
            self._in_trouble = False
            self.kit.diagnose("rendering", Level.OK, "pictures are made again")
        return picture

    def _note_trouble(self, error: Exception) -> None:
        self._in_trouble = True
        self.kit.diagnose("rendering", Level.ERROR, f"{type(error).__name__}: {error}")

    def _note_rate(self, count: int = 1) -> float:
        """Count pictures that were just taken; returns the rate (Hz) of the last seconds."""
        now = self.kit.now()
        self._taken.extend([now] * count)
        while self._taken and self._taken[0] <= now - RECENT:
            self._taken.popleft()
        seconds = min(RECENT, now - self._active_since)
        return len(self._taken) / seconds if seconds > 0.0 else 0.0

    def _note_failure(self) -> str:
        """Return how the camera fails now, and publish changes."""
        failure = self.failure if self.failure != NONE else self._schedule.at(self.kit.now())
        if failure != self._failing:
            self._failing = failure
            self.kit.event("camera.failure", f"{self.pictures}: {failure}", sensor=self.pictures, failure=failure)
        return failure

    def settings(self, settings: CameraSettings) -> CameraSettings:
        """Return the settings of the renderer, with what a subclass adds."""
        return settings

    @abstractmethod
    def take(self, eye: Eye, moment: RenderState) -> Any:
        """Return the pixels of a moment."""

    @abstractmethod
    def black(self, width: int, height: int) -> Any:
        """Return the pixels of a camera that sees nothing."""

    @abstractmethod
    def message(self, view: View, pixels: Any) -> Any:
        """Return the message with pixels."""

    def _pixels(self, eye: Eye, shown: Moment | None) -> Any:
        if shown is None:
            return self.black(*self._size)
        state = self._state(shown)
        colours = {lamp.geom: (lamp.red, lamp.green, lamp.blue) for lamp in state.colours}
        # The step seeds the noise: the number of the tick distinguishes moments just as well.
        return self.take(eye, RenderState(state.positions, state.light, state.tick, colours))

    def _state(self, moment: Moment) -> WorldState:
        state = moment()
        if state is None:
            raise LookupError("the world no longer has the moment that the picture is to show")
        if not self._is_ours(state):
            raise LookupError("the world that runs is another one")
        return state

    def _is_ours(self, state: WorldState | None) -> bool:
        """Refuse to draw a world that is not the one in the file: the picture would be a lie."""
        if state is None:
            return False
        self._knows_world = state.model_hash == self._hash
        if self._knows_world:
            if self._foreign:
                self._foreign = ""
                self.kit.diagnose("world_state", Level.OK, f"the world that runs is {self.file}: pictures are taken")
            return True
        if self._foreign != state.model_hash:
            self._foreign = state.model_hash
            text = f"the world that runs (seed {state.seed}) is not {self.file} with seed {self.kit.seed}"
            self.kit.diagnose("world_state", Level.ERROR, f"{text}: no pictures")
        return False

    def evaluate(self) -> dict[str, float]:
        """Return the ``rate`` (Hz) at which pictures were taken in the last 5 s: none while nobody wants them."""
        return {"rate": self._note_rate(0)}

    def on_cleanup(self) -> None:
        """Give the renderer back."""
        self._close()

    def on_shutdown(self) -> None:
        """Give the renderer back."""
        self._close()

    def on_error(self) -> None:
        """Give the renderer back; the camera may be configured again."""
        self._close()

    def _close(self) -> None:
        eye, self._eye = self._eye, None
        if eye is not None:
            eye.close()
