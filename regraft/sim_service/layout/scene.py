"""Loading an MJCF world and finding its elements by name."""

import copy
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import mujoco

from regraft.sim_service.layout.composition import CompositionError, composed, unchanged
from regraft.sim_service.layout.fingerprint import fingerprint_of
from regraft.sim_service.robots import RobotSpec

KINDS = {
    "body": (mujoco.mjtObj.mjOBJ_BODY, "nbody"),
    "joint": (mujoco.mjtObj.mjOBJ_JOINT, "njnt"),
    "geom": (mujoco.mjtObj.mjOBJ_GEOM, "ngeom"),
    "site": (mujoco.mjtObj.mjOBJ_SITE, "nsite"),
    "camera": (mujoco.mjtObj.mjOBJ_CAMERA, "ncam"),
    "light": (mujoco.mjtObj.mjOBJ_LIGHT, "nlight"),
    "actuator": (mujoco.mjtObj.mjOBJ_ACTUATOR, "nu"),
    "text": (mujoco.mjtObj.mjOBJ_TEXT, "ntext"),
    "tuple": (mujoco.mjtObj.mjOBJ_TUPLE, "ntuple"),
    "material": (mujoco.mjtObj.mjOBJ_MATERIAL, "nmat"),
}


class SceneError(ValueError):
    """A world file is wrong or lacks something; the message names the file and the element."""


@dataclass(frozen=True, slots=True)
class Scene:
    """A compiled world, which is never edited: to change lights or positions, take a model of your own."""

    path: Path
    model: mujoco.MjModel
    fingerprint: str
    """SHA-256 of the compiled world, robots included; equal wherever its files lie."""
    robots: tuple[RobotSpec, ...] = ()
    change: Callable[[mujoco.MjSpec], None] = unchanged
    """Makes of the world's file what was compiled; for who compiles it again."""
    parts: Mapping[str, tuple[int, ...]] = field(default_factory=dict)
    """The outermost bodies of each robot's own file, by the robot's name."""

    def new_model(self) -> mujoco.MjModel:
        """Return a copy of the model that the caller may change."""
        return copy.deepcopy(self.model)

    def names(self, kind: str) -> list[str]:
        """Return the names of all elements of a kind ("body", "camera", ...), unnamed ones left out."""
        object_type, count = KINDS[kind]
        every = (mujoco.mj_id2name(self.model, object_type, i) for i in range(getattr(self.model, count)))
        return [name for name in every if name]

    def index(self, kind: str, name: str) -> int:
        """Return the number of the named element.

        Raises:
            SceneError: there is none; the message lists those there are.
        """
        index = int(mujoco.mj_name2id(self.model, KINDS[kind][0], name))
        if index < 0:
            there = ", ".join(self.names(kind)) or "none"
            raise SceneError(f"{self.path}: no {kind} named {name!r}; there are: {there}")
        return index

    def body_name(self, body: int) -> str:
        """Return the name of a body, or its number as text if it has none."""
        return self._name("body", body)

    def geom_name(self, geom: int) -> str:
        """Return the name of a geom, or its number as text if it has none."""
        return self._name("geom", geom)

    def free_joint_dof(self, body: str) -> int:
        """Return where the 6 velocities of the body's free joint begin in qvel.

        Raises:
            SceneError: the body does not exist or is not free.
        """
        return int(self.model.jnt_dofadr[self._needed_free_joint(body)])

    def free_joint_position(self, body: str) -> int:
        """Return where the body's 7 free coordinates begin in qpos; raises like `free_joint_dof`."""
        return int(self.model.jnt_qposadr[self._needed_free_joint(body)])

    def free_coordinates(self, body: int) -> int | None:
        """Return where the 7 coordinates of a body with a free joint begin in qpos; None if it has none."""
        joint = self._free_joint(body)
        return None if joint is None else int(self.model.jnt_qposadr[joint])

    def is_static(self, body: int) -> bool:
        """Return whether the body is fixed to the world."""
        return int(self.model.body_weldid[body]) == 0

    def is_free(self, body: int) -> bool:
        """Return whether the body moves freely, or hangs on one that does."""
        return self._free_joint(int(self.model.body_rootid[body])) is not None

    def subtree(self, body: int) -> list[int]:
        """Return the body and all bodies that hang on it."""
        members = {body}
        for child in range(body + 1, self.model.nbody):
            if int(self.model.body_parentid[child]) in members:
                members.add(child)
        return sorted(members)

    def geoms_of(self, body: int) -> list[int]:
        """Return the geoms of the body and of all bodies that hang on it."""
        members = set(self.subtree(body))
        return [geom for geom in range(self.model.ngeom) if int(self.model.geom_bodyid[geom]) in members]

    def texts(self) -> dict[str, str]:
        """Return the world's `<custom><text>` entries in the file's order."""
        texts = {}
        for i, name in enumerate(self.names("text")):
            start, size = int(self.model.text_adr[i]), int(self.model.text_size[i])
            texts[name] = bytes(self.model.text_data[start : start + size]).split(b"\0")[0].decode()
        return texts

    def bodies_of_tuple(self, name: str) -> list[str]:
        """Return the names of the bodies in an MJCF `<custom><tuple>`, in its order.

        Raises:
            SceneError: there is no such tuple, or it lists something other than bodies.
        """
        number = self.index("tuple", name)
        start, size = int(self.model.tuple_adr[number]), int(self.model.tuple_size[number])
        members = range(start, start + size)
        if any(int(self.model.tuple_objtype[i]) != int(mujoco.mjtObj.mjOBJ_BODY) for i in members):
            raise SceneError(f"{self.path}: tuple {name!r} must list bodies only")
        return [self.body_name(int(self.model.tuple_objid[i])) for i in members]

    def _name(self, kind: str, number: int) -> str:
        name = mujoco.mj_id2name(self.model, KINDS[kind][0], number)
        return str(name) if name else f"{kind} {number}"

    def _free_joint(self, body: int) -> int | None:
        joint = int(self.model.body_jntadr[body])
        is_free = joint >= 0 and int(self.model.jnt_type[joint]) == int(mujoco.mjtJoint.mjJNT_FREE)
        return joint if is_free else None

    def _needed_free_joint(self, body: str) -> int:
        joint = self._free_joint(self.index("body", body))
        if joint is None:
            raise SceneError(f"{self.path}: body {body!r} needs a <freejoint/>")
        return joint


def load_scene(
    path: str | Path, robots: Sequence[RobotSpec] = (), change: Callable[[mujoco.MjSpec], None] = unchanged
) -> Scene:
    """Load a world's MJCF file and those of its robots, and compile them into one; ``change`` may alter it before.

    A world whose room is drawn is loaded by `regraft.sim_service.rooms.loading.load_world`.

    Raises:
        SceneError: a file is missing or MuJoCo refuses it; MuJoCo's message names line and element.
    """
    file = Path(path)
    if not file.is_file():
        raise SceneError(f"{file}: no such world file")
    try:
        made = composed(file, robots, change)
    except CompositionError as error:
        raise SceneError(str(error)) from error
    scene = Scene(file, made.model, fingerprint_of(made.model), tuple(robots), change, made.parts)
    for robot in robots:
        scene.index("body", robot.body)
    return scene
