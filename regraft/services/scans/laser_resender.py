"""Passes on the scans of a lidar while they are plausible."""

from __future__ import annotations

from regraft import Input, Output, Parameter, every
from regraft.bus_schema.messages.sensors import LaserScan
from regraft.bus_schema.model.description import Resources
from regraft.services import robot_parameters
from regraft.services.scans.plausibility import ScanJudge, Tolerances
from regraft.services.scans.powered import PoweredComponent
from regraft.services.sensor_checks import Finding

LOOKS = 5.0
"""Hz, of the looks whether scans come."""


def _seconds(default: float, description: str) -> Parameter[float]:
    return Parameter(default, description, minimum=0.05, maximum=60.0, unit="s")


class LaserResender(PoweredComponent):
    """Passes on plausible scans unchanged, and fails when the lidar is silent, frozen, ahead, or measures nothing.

    It fails by itself: it goes through error processing and is unconfigured, with the reason as its failure. So
    supervision and observers of components see that the lidar cannot be used. A further configuration and activation
    tries the lidar again. A working lidar has noise: a scan that equals the one before is not passed on.
    """

    resources = Resources(cpu=0.01, memory=20.0)

    silent_after = _seconds(0.6, "how old the newest scan may be")
    first_within = _seconds(1.0, "how long the first scan may take after an activation")
    frozen_after = _seconds(1.0, "how long the same scan may come again and again")
    zero_share = Parameter(
        0.5,
        "share of the ranges that are 0 or below the least, from which on a scan is of no use",
        minimum=0.01,
        maximum=1.0,
    )
    useless_scans = Parameter(2, "so many scans in a row that are of no use are a failure", minimum=1, maximum=100)
    power = robot_parameters.lidar_power()

    raw = Input(LaserScan, description="the scans of the lidar")
    scan = Output(LaserScan, description="the plausible ones")

    def on_activate(self) -> None:
        """Give the lidar a while to be heard."""
        super().on_activate()
        self._judge = ScanJudge(self.kit.now())

    @raw.handler
    def on_raw(self, scan: LaserScan) -> None:
        """Pass a plausible scan on."""
        plausible, fault = self._judge.judge(scan, self.kit.now(), self._tolerances())
        if plausible:
            self.scan.publish(scan)
        self._fail_by(fault)

    @every(hz=LOOKS)
    def look(self) -> None:
        """Notice a lidar that is silent."""
        self._fail_by(self._judge.silence(self.kit.now(), self._tolerances()))

    def _fail_by(self, fault: Finding | None) -> None:
        if fault is not None:
            self.book()
            self.kit.fail(f"the lidar fails ({fault.fault}): {fault.text}")

    def _tolerances(self) -> Tolerances:
        return Tolerances(self.silent_after, self.first_within, self.frozen_after, self.zero_share, self.useless_scans)
