"""An inertial measurement unit."""

import math
from collections.abc import Mapping
from typing import Any

import mujoco
import numpy as np
import numpy.typing as npt

from regraft import Output, Parameter
from regraft.bus_schema.messages.geometry import Quaternion, Vector3
from regraft.bus_schema.messages.sensors import Imu
from regraft.sim_service.devices.core.failure_schedule import BIAS, NOISE
from regraft.sim_service.devices.core.sensor import Sensor, failure_parameter

Floats = npt.NDArray[np.float64]


class InertialUnit(Sensor):
    """Measures angular velocity and specific force at an MJCF site, in the site's frame.

    Both are those of the last physics step, as MuJoCo's gyro and accelerometer give them. White noise of density N
    makes errors of N * sqrt(rate); biases walk at random from zero. The noise densities are those of an MPU-9250, the
    unit of a TurtleBot3 (InvenSense PS-MPU-9250A-01: 0.01 deg/s/sqrt(Hz) and 300 ug/sqrt(Hz)). It has no data on walks:
    those are of the ADIS16448 in M. Burri et al.: The EuRoC micro aerial vehicle datasets, IJRR 35(10), 2016.
    """

    measures = "imu"

    imu = Output(Imu, description="angular velocity and specific force")

    site = Parameter("imu", "the MJCF site where it is", read_only=True)
    rate = Parameter(0.0, "measurements per second; 0: one each tick", minimum=0.0, unit="Hz", read_only=True)
    orientation = Parameter(False, "whether it gives its orientation, which is exact", read_only=True)
    gyro_noise = Parameter(
        1.745e-4, "noise density of angular velocities", minimum=0.0, unit="rad/s/sqrt(Hz)", read_only=True
    )
    gyro_walk = Parameter(
        1.94e-5, "density of the random walk of their bias", minimum=0.0, unit="rad/s2/sqrt(Hz)", read_only=True
    )
    force_noise = Parameter(
        2.94e-3, "noise density of specific forces", minimum=0.0, unit="m/s2/sqrt(Hz)", read_only=True
    )
    force_walk = Parameter(
        3.0e-3, "density of the random walk of their bias", minimum=0.0, unit="m/s3/sqrt(Hz)", read_only=True
    )
    failure = failure_parameter(BIAS, NOISE)
    gyro_bias = Parameter(0.1, "what the failure bias adds to each angular velocity", unit="rad/s")
    force_bias = Parameter(0.5, "what the failure bias adds to each specific force", unit="m/s2")
    more_noise = Parameter(20.0, "by how many times the failure noise increases the noise", minimum=1.0)

    def build(self) -> None:
        """Find the site; raises SceneError."""
        self._site = self.kit.index("site", self.site)
        self._motion = np.zeros(6)
        """Angular velocity (rad/s) and specific force (m/s2) at the last tick, without errors."""
        self._walk = np.zeros(6)
        """The biases of both."""

    def tick(self) -> None:
        """Take the motion from the last physics step, and let the biases walk."""
        model, data, progress = self.kit.model, self.kit.data, self.kit.progress
        # This changes nothing that the physics continues from.
        mujoco.mj_rnePostConstraint(model, data)
        velocity, acceleration = np.empty(6), np.empty(6)
        mujoco.mj_objectVelocity(model, data, mujoco.mjtObj.mjOBJ_SITE, self._site, velocity, 1)
        mujoco.mj_objectAcceleration(model, data, mujoco.mjtObj.mjOBJ_SITE, self._site, acceleration, 1)
        self._motion = np.concatenate([velocity[:3], acceleration[3:]])
        density = self._densities(self.gyro_walk, self.force_walk)
        if density.any():
            random = self.kit.random(f"{self.kit.name} walk", progress.tick)
            self._walk = self._walk + density * math.sqrt(1.0 / progress.tick_rate) * random.standard_normal(6)

    @staticmethod
    def _densities(gyro: float, force: float) -> Floats:
        return np.repeat([gyro, force], 3)

    def measure(self) -> Imu:
        """Return the motion with noise and biases, spoiled by what fails."""
        kit = self.kit
        noise = self._densities(self.gyro_noise, self.force_noise) * math.sqrt(self.rate or kit.progress.tick_rate)
        if kit.failing == NOISE:
            noise *= self.more_noise
        errors = noise * kit.random(kit.name, kit.progress.tick).standard_normal(6) + self._walk
        if kit.failing == BIAS:
            errors += self._densities(self.gyro_bias, self.force_bias)
        wx, wy, wz, fx, fy, fz = (self._motion + errors).tolist()
        return Imu(kit.stamp, kit.frame(self.site), Vector3(wx, wy, wz), Vector3(fx, fy, fz), self._orientation())

    def _orientation(self) -> Quaternion | None:
        if not self.orientation:
            return None
        quaternion = np.empty(4)
        mujoco.mju_mat2Quat(quaternion, self.kit.data.site_xmat[self._site])
        w, x, y, z = quaternion.tolist()
        return Quaternion(x, y, z, w)

    def snapshot(self) -> dict[str, Any]:
        """Return motion, biases and the last message."""
        return {**super().snapshot(), "motion": self._motion.tolist(), "walk": self._walk.tolist()}

    def restore(self, state: Mapping[str, Any]) -> None:
        """Take over motion, biases and the last message."""
        super().restore(state)
        self._motion, self._walk = np.array(state["motion"], np.float64), np.array(state["walk"], np.float64)
