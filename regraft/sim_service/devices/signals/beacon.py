"""Beacons, and receivers that see where other robots' beacons are."""

import math

from regraft import Output, Parameter
from regraft.bus_schema.messages.devices.ranging import BeaconSighting, BeaconSightings
from regraft.sim_service.devices.core.device import Device
from regraft.sim_service.devices.core.failure_schedule import BIAS, DROPOUT, NOISE, NONE, SILENT
from regraft.sim_service.devices.core.sensor import Sensor, failure_parameter
from regraft.sim_service.devices.signals.sight import is_clear, root_of
from regraft.sim_service.layout.headings import wrap_heading


class Beacon(Device):
    """Shines at an MJCF site so that other robots' receivers see it."""

    site = Parameter("beacon", "the MJCF site where it shines", read_only=True)
    label = Parameter("", "what receivers take it for; empty: the name of its robot")
    failure = Parameter(NONE, "how it fails now", choices=(NONE, SILENT))

    def build(self) -> None:
        """Find the site; raises SceneError."""
        self.site_index = self.kit.index("site", self.site)
        self.root = root_of(self.kit, self.site_index)

    @property
    def shines(self) -> bool:
        """Whether it can be seen at all now."""
        return self.kit.failing == NONE


class BeaconReceiver(Sensor):
    """Sees the other robots' beacons within reach: bearing and distance of each that no body hides.

    Bearings are about z of the robot's base, as seen from its MJCF site. Its own robot and the beacon's robot hide
    nothing. The reach of 0.8 m is that with which ARGoS simulates the e-puck's range and bearing board (A. Gutierrez
    et al.: Open e-puck range & bearing miniaturized board for local communication in swarm robotics, ICRA 2009). The
    noise is an assumption.
    """

    measures = "beacons"

    beacons = Output(BeaconSightings, description="the other robots' beacons in sight")

    site = Parameter("beacon", "the MJCF site where it is", read_only=True)
    reach = Parameter(0.8, "distance up to which it sees a beacon", minimum=0.01, unit="m", read_only=True)
    rate = Parameter(10.0, "measurements per second", minimum=0.1, unit="Hz", read_only=True)
    bearing_noise = Parameter(0.05, "standard deviation of a bearing", minimum=0.0, unit="rad", read_only=True)
    distance_noise = Parameter(
        0.05, "standard deviation of a distance, as a share of it", minimum=0.0, maximum=1.0, read_only=True
    )
    failure = failure_parameter(DROPOUT, BIAS, NOISE)
    dropout = Parameter(0.5, "share of the beacons that a dropout loses at a time", minimum=0.0, maximum=1.0)
    bias = Parameter(0.3, "what a bias adds to each bearing", unit="rad")
    more_noise = Parameter(0.3, "standard deviation that the failure noise adds to a bearing", minimum=0.0, unit="rad")

    def build(self) -> None:
        """Find the site; raises SceneError."""
        self._site = self.kit.index("site", self.site)
        self._root = root_of(self.kit, self._site)

    def measure(self) -> BeaconSightings:
        """Return the beacons in sight, with noise, spoiled by what fails."""
        found = (self._sighting(robot, beacon) for robot, beacon in self.kit.others_of(Beacon) if beacon.shines)
        seen = tuple(sighting for sighting in found if sighting is not None)
        return BeaconSightings(self.kit.stamp, self.kit.frame("base_link"), seen)

    def _sighting(self, robot: str, beacon: Beacon) -> BeaconSighting | None:
        kit, data = self.kit, self.kit.data
        here, there = data.site_xpos[self._site], data.site_xpos[beacon.site_index]
        away = data.xmat[kit.base].reshape(3, 3).T @ (there - here)
        distance = math.hypot(*away)
        if distance > self.reach or not is_clear(kit, here, there, self._root, beacon.root):
            return None
        # Each beacon has noise of its own: one more in the world does not change it.
        random = kit.random(f"{kit.name} {robot} {beacon.kit.name}", kit.progress.tick)
        chance = random.random()
        errors = random.standard_normal(3)
        if kit.failing == DROPOUT and chance < self.dropout:
            return None
        bearing = math.atan2(away[1], away[0]) + self.bearing_noise * errors[0]
        if kit.failing == BIAS:
            bearing += self.bias
        if kit.failing == NOISE:
            bearing += self.more_noise * errors[2]
        measured = max(0.0, distance * (1.0 + self.distance_noise * float(errors[1])))
        return BeaconSighting(beacon.label or robot, wrap_heading(float(bearing)), measured)
