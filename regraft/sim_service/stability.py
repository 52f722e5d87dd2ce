"""Finds out when physics no longer makes sense, and where that began."""

from __future__ import annotations

from collections.abc import Mapping

import mujoco

from regraft.sim_service.layout.scene import Scene

QUANTITIES: Mapping[int, str] = {
    int(mujoco.mjtWarning.mjWARN_BADQPOS): "position",
    int(mujoco.mjtWarning.mjWARN_BADQVEL): "velocity",
    int(mujoco.mjtWarning.mjWARN_BADCTRL): "control signal",
    int(mujoco.mjtWarning.mjWARN_BADQACC): "acceleration",
}
"""The quantity of each of MuJoCo's warnings, in the order in which a physics step looks at them."""


class UnstablePhysics(ValueError):
    """A number of the physics is not finite or beyond all measure; the text names the element and its robot.

    ``element`` is the joint, the actuator, or the body of a joint without a name. ``robot`` is empty if no robot with
    a name has it.
    """

    def __init__(self, quantity: str, kind: str, element: str, robot: str, time: float) -> None:
        self.element, self.robot = element, robot
        of = f" of the robot {robot!r}" if robot else ""
        super().__init__(
            f"the physics has become unstable: the {quantity} of the {kind} {element!r}{of} "
            f"is not finite or beyond {mujoco.mjMAXVAL:.0e} at {time:g} s"
        )


class StabilityCheck:
    """Looks whether MuJoCo has found a number that makes no sense in a physics step.

    By default MuJoCo then puts the whole world back to the pose of its file, which is switched off here. Of a control
    signal it takes the signals of all actuators for zero. Nobody may continue after that.
    """

    def __init__(self, scene: Scene, model: mujoco.MjModel, data: mujoco.MjData) -> None:
        model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_AUTORESET)
        self._scene, self._model, self._data = scene, model, data
        self._counts = data.warning.number
        """How often there was each warning; MuJoCo keeps it up to date."""

    def check(self) -> None:
        """Raise UnstablePhysics if any step so far had a number that makes no sense."""
        counts = self._counts.tolist()
        for warning, quantity in QUANTITIES.items():
            if counts[warning]:
                kind, element = self._element(warning, int(self._data.warning.lastinfo[warning]))
                named = (spec for spec in self._scene.robots if spec.name and element.startswith(spec.prefix))
                robot = next((spec.name for spec in named), "")
                raise UnstablePhysics(quantity, kind, element, robot, float(self._data.time))

    def _element(self, warning: int, index: int) -> tuple[str, str]:
        """Return the kind and the name of what a warning is about."""
        model = self._model
        if warning == int(mujoco.mjtWarning.mjWARN_BADCTRL):
            name = mujoco.mj_id2name(model, mujoco.mjtObj.mjOBJ_ACTUATOR, index)
            return "actuator", str(name) if name else f"actuator {index}"
        if warning == int(mujoco.mjtWarning.mjWARN_BADQPOS):
            joint = max(n for n in range(model.njnt) if int(model.jnt_qposadr[n]) <= index)
        else:
            joint = int(model.dof_jntid[index])
        name = mujoco.mj_id2name(model, mujoco.mjtObj.mjOBJ_JOINT, joint)
        return ("joint", str(name)) if name else ("body", self._scene.body_name(int(model.jnt_bodyid[joint])))
