"""How a node class declares its ports, and how it reads and writes them.

    class Reach(StatefulAction):
        goal = Input(Pose, description="where to go")
        distance = Output(float, description="how far it is still, in metres")

        def on_start(self) -> Status:
            self.distance = self.robot.distance_to(self.goal)

Reading a port gives the literal of the XML attribute, or the value of the blackboard entry that it names.
"""

from typing import TYPE_CHECKING, Any, Generic, Self, TypeVar, overload

from ..errors import RegistryError
from .manifest import Direction, PortModel, check_port_name

if TYPE_CHECKING:
    from .node import Node

T = TypeVar("T")


class Port(Generic[T]):
    """The base of inputs and outputs: a model built from the class attribute."""

    direction: Direction

    def __init__(
        self,
        kind: type[T] | None = None,
        *,
        default: T | str | None = None,
        description: str = "",
        name: str = "",
    ) -> None:
        """Declare a port.

        Args:
            kind: The type of its values; None means any.
            default: The value of an input if the XML attribute is absent; text is read as the attribute would
                be.
            description: Its purpose.
            name: The XML attribute, where it cannot be the name of the Python attribute.
        """
        self._type = kind
        self._default = default
        self._description = description
        self._name = name

    def __set_name__(self, owner: "type[Node]", attribute: str) -> None:
        """Take the name of the Python attribute unless another was given."""
        self._name = self._name or attribute

    @property
    def model(self) -> PortModel:
        """The port as others see it."""
        return PortModel(self._name, self.direction, self._type, self._default, self._description)


class Input(Port[T]):
    """A port that the node reads; reading raises PortError where there is nothing to read."""

    direction = Direction.INPUT

    @overload
    def __get__(self, node: None, owner: "type[Node]") -> Self: ...
    @overload
    def __get__(self, node: "Node", owner: "type[Node]") -> T: ...
    def __get__(self, node: "Node | None", owner: "type[Node]") -> Self | T:
        """Read the port."""
        if node is None:
            return self
        value: T = node.read_port(self._name)
        return value

    def __set__(self, node: "Node", value: T) -> None:
        """Refuse to write, so that a slip does not hide the port."""
        raise AttributeError(f"port '{self._name}' is an input; declare an InOut to write it")


class Output(Port[T]):
    """A port that the node writes; writing raises PortError where the XML connects it to no entry."""

    direction = Direction.OUTPUT

    @overload
    def __get__(self, node: None, owner: "type[Node]") -> Self: ...
    @overload
    def __get__(self, node: "Node", owner: "type[Node]") -> T: ...
    def __get__(self, node: "Node | None", owner: "type[Node]") -> Self | T:
        """Refuse to read."""
        if node is None:
            return self
        raise AttributeError(f"port '{self._name}' is an output; declare an InOut to read it")

    def __set__(self, node: "Node", value: T) -> None:
        """Write the port."""
        node.write_port(self._name, value)


class InOut(Input[T]):
    """A port that the node reads and writes."""

    direction = Direction.INOUT

    def __set__(self, node: "Node", value: T) -> None:
        """Write the port."""
        node.write_port(self._name, value)


def declared_ports(node_class: type[Any], reserved: type[Any]) -> dict[str, PortModel]:
    """Return the ports that a class and its bases declare, by name.

    Args:
        node_class: The class.
        reserved: The class whose own attributes no port may hide.

    Raises:
        RegistryError: A port has an impossible name, or hides an attribute of every node.
    """
    models: dict[str, PortModel] = {}
    for base in reversed(node_class.__mro__):
        for attribute, port in vars(base).items():
            if not isinstance(port, Port):
                continue
            if attribute in reserved.__annotations__ or hasattr(reserved, attribute):
                raise RegistryError(
                    f"{node_class.__name__}.{attribute} hides an attribute that every node has; "
                    f'call it otherwise and declare the port with name="{attribute}"'
                )
            check_port_name(port.model.name)
            models[port.model.name] = port.model
    return models
