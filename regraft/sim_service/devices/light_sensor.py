"""A sensor for the brightness where it is."""

import mujoco
import numpy as np

from regraft import Output, Parameter
from regraft.bus_schema.messages.sensors import Illuminance
from regraft.sim_service.cameras.room_lamps import is_directional, lamp_share
from regraft.sim_service.devices.core.failure_schedule import BIAS, NOISE
from regraft.sim_service.devices.core.sensor import Sensor, failure_parameter
from regraft.sim_service.devices.signals.sight import is_clear, root_of

LUMINANCE = np.array([0.2126, 0.7152, 0.0722])
"""Shares of red, green and blue in what the eye calls bright (ITU-R BT.709)."""
FAR = 1000.0
"""m that a ray towards a lamp at no place goes."""


class LightSensor(Sensor):
    """Measures the illuminance of its MJCF site, which faces along its x axis.

    Lamps count by angle and distance as in the MJCF, so that cameras and sensor see one world. A lamp does not count
    where a body is between; its own robot and what carries the lamp hide nothing. The headlight counts by its ambient
    part, which models light from everywhere. The world's light level dims all. MJCF has no unit of light: ``scale`` is
    what intensity 1 means. Its default of 500 lx is what EN 12464-1 requires at desks. Range and resolution are those
    of a BH1750FVI (ROHM datasheet: 1 to 65535 lx in steps of 1 lx); the noise is an assumption.
    """

    measures = "illuminance"

    illuminance = Output(Illuminance, description="how bright it is where the sensor is")

    site = Parameter("light_sensor", "the MJCF site where it is", read_only=True)
    scale = Parameter(
        500.0, "illuminance that a lamp of intensity 1 gives from the front", minimum=0.0, unit="lx", read_only=True
    )
    maximum = Parameter(65535.0, "what it shows at most", minimum=0.0, unit="lx", read_only=True)
    resolution = Parameter(1.0, "step of what it shows; 0: none", minimum=0.0, unit="lx", read_only=True)
    rate = Parameter(5.0, "measurements per second", minimum=0.1, unit="Hz", read_only=True)
    noise = Parameter(0.01, "standard deviation, as a share of the value", minimum=0.0, read_only=True)
    failure = failure_parameter(BIAS, NOISE)
    bias = Parameter(100.0, "what a bias adds", unit="lx")
    more_noise = Parameter(0.5, "standard deviation that the failure noise adds, as a share of the value", minimum=0.0)

    def build(self) -> None:
        """Find the site; raises SceneError."""
        self._site = self.kit.index("site", self.site)
        self._root = root_of(self.kit, self._site)

    def true_illuminance(self) -> float:
        """Return the illuminance (lx) now, without errors."""
        model, data = self.kit.model, self.kit.data
        # The physics leaves lamps that move where they were at the beginning of its last step.
        mujoco.mj_camlight(model, data)
        light = np.array(model.vis.headlight.ambient, np.float64)
        for lamp in range(model.nlight):
            if model.light_active[lamp]:
                light += model.light_ambient[lamp] + self._share(lamp) * model.light_diffuse[lamp]
        return float(LUMINANCE @ light) * self.scale * self.kit.light()

    def _share(self, lamp: int) -> float:
        model, data = self.kit.model, self.kit.data
        here = data.site_xpos[self._site]
        facing = data.site_xmat[self._site].reshape(3, 3)[:, 0].astype(np.float32)
        share = float(lamp_share(model, data, lamp, here[None, :], facing[None, :])[0])
        if share == 0.0:
            return 0.0
        if is_directional(model, lamp):
            return share if is_clear(self.kit, here, here - FAR * data.light_xdir[lamp], self._root) else 0.0
        carrier = int(model.body_rootid[model.light_bodyid[lamp]])
        spared = (self._root, carrier) if carrier else (self._root,)
        return share if is_clear(self.kit, here, data.light_xpos[lamp].copy(), *spared) else 0.0

    def measure(self) -> Illuminance:
        """Return the illuminance with its noise, spoiled by what fails."""
        kit = self.kit
        errors = kit.random(kit.name, kit.progress.tick).standard_normal(2)
        deviation = self.noise * errors[0] + (self.more_noise * errors[1] if kit.failing == NOISE else 0.0)
        value = self.true_illuminance() * (1.0 + float(deviation)) + (self.bias if kit.failing == BIAS else 0.0)
        if self.resolution > 0.0:
            value = round(value / self.resolution) * self.resolution
        return Illuminance(kit.stamp, kit.frame(self.site), min(max(value, 0.0), self.maximum))
