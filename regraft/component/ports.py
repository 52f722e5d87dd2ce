"""Ports of a component: typed inputs and outputs, each connected to a topic."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from copy import copy
from typing import Any, Generic, TypeVar, overload

from regraft.bus_schema.encoding.reading import Reading
from regraft.bus_schema.encoding.registry import type_of
from regraft.bus_schema.model.description import ANY_TYPE, PortDescription
from regraft.component.live_ports import InputPort, OutputPort

M = TypeVar("M")
H = TypeVar("H", bound=Callable[..., Any])


def handled_by(function: Callable[..., Any]) -> tuple[Input[Any], ...]:
    """Return the inputs whose messages a function was declared to handle."""
    inputs: tuple[Input[Any], ...] = getattr(function, "__regraft_handles__", ())
    return inputs


def with_handler(port: Input[M], name: str) -> Input[M]:
    """Return the same input, each of whose messages the method ``name`` handles."""
    other = copy(port)
    other.handler_name = name
    return other


class Input(Generic[M]):
    """An input: messages of one type from the topic it is connected to.

    Without a handler, an input is only read (``latest``, ``take``, ``next``), and its messages wake nobody.
    """

    def __init__(
        self,
        message: type[M] | None,
        *,
        topic: str | None = None,
        latest_only: bool = False,
        on_demand: bool = False,
        required: bool = True,
        keep: int = 0,
        description: str = "",
        reads: Sequence[Reading] = (),
        name: str = "",
        origin: str = "",
        handler: str = "",
    ) -> None:
        """Declare an input.

        Args:
            message: the message class; None takes every message of the topic.
            topic: the topic it has unless the stack states another; the port's name by default.
            latest_only: see only the newest message, for sensor streams.
            on_demand: in simulated time have only those messages made and sent that ``latest`` or ``next`` opens. For
                large messages most of which nobody opens; with ``latest_only`` alone, and without a handler.
            required: whether a stack must feed it.
            keep: how many messages wait for ``take`` at the most, then the oldest are dropped; 0 if it is not used.
            description: what it is for.
            reads: what must be there to be read in messages of any type.
            name: its name, where `Component.ports_for` returns it; in a class body it is the attribute's.
            origin: the part of a parameter's value that asks for it, such as ``mapping.0``; with `ports_for` only.
            handler: the method that handles every message; it takes the port's name and the message. With `ports_for`
                only.
        """
        if on_demand and (keep or handler or not latest_only):
            raise TypeError("an input that is read on_demand is latest_only, keeps nothing and has no handler")
        self.message = message
        self.topic = topic
        self.latest_only = latest_only
        self.on_demand = on_demand
        self.required = required
        self.keep = keep
        self.description = description
        self.reads = tuple(reads)
        self.name = name
        self.origin = origin
        self.handler_name: str | None = handler or None
        self.handler_takes_name = bool(handler)

    def __set_name__(self, owner: type, name: str) -> None:
        self.name = name

    @overload
    def __get__(self, instance: None, owner: type) -> Input[M]: ...

    @overload
    def __get__(self, instance: object, owner: type) -> InputPort[M]: ...

    def __get__(self, instance: object, owner: type) -> Input[M] | InputPort[M]:
        """Return the declaration on the class; an instance has the live port of the same name itself."""
        if instance is not None:
            raise AttributeError(f"the input {self.name!r} is live only in a component that runs")
        return self

    def handler(self, function: H) -> H:
        """Make the decorated method handle every message of this input (``latest_only``: the newest)."""
        if self.on_demand:
            raise TypeError(f"the input {self.name!r} is read on_demand: no handler opens all of its messages")
        if not self.name:  # in the body of the class that declares it
            self.handler_name = function.__name__
        else:  # a subclass handles it, which is no matter of its base
            marked: Any = function
            marked.__regraft_handles__ = (*handled_by(function), self)
        return function

    def describe(self) -> PortDescription:
        """Return the port's description."""
        kind = type_of(self.message) if self.message else None
        return PortDescription(
            self.name,
            "input",
            kind.name if kind else ANY_TYPE,
            kind.version if kind else 0,
            self.topic or self.name,
            self.required,
            self.latest_only,
            self.description,
            self.reads,
            self.origin,
        )


class Output(Generic[M]):
    """An output: messages of one type to the topic it is connected to."""

    def __init__(
        self,
        message: type[M],
        *,
        topic: str | None = None,
        reliable: bool = True,
        required: bool = True,
        description: str = "",
        name: str = "",
        origin: str = "",
    ) -> None:
        """Declare an output.

        Args:
            message: the message class.
            topic: the topic it has unless the stack states another; the port's name by default.
            reliable: block, within bounds, rather than drop; the stack's topic table overrides it.
            required: whether a stack must list its topic.
            description: what it carries.
            name: as for an input.
            origin: as for an input.
        """
        self.message = message
        self.topic = topic
        self.reliable = reliable
        self.required = required
        self.description = description
        self.name = name
        self.origin = origin

    def __set_name__(self, owner: type, name: str) -> None:
        self.name = name

    @overload
    def __get__(self, instance: None, owner: type) -> Output[M]: ...

    @overload
    def __get__(self, instance: object, owner: type) -> OutputPort[M]: ...

    def __get__(self, instance: object, owner: type) -> Output[M] | OutputPort[M]:
        """Return the declaration on the class; an instance has the live port of the same name itself."""
        if instance is not None:
            raise AttributeError(f"the output {self.name!r} is live only in a component that runs")
        return self

    def describe(self) -> PortDescription:
        """Return the port's description."""
        kind = type_of(self.message)
        topic, required = self.topic or self.name, self.required
        return PortDescription(
            self.name,
            "output",
            kind.name,
            kind.version,
            topic,
            required,
            description=self.description,
            origin=self.origin,
        )
