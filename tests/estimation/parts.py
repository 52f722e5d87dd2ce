"""Components whose estimates depend on what feeds them, and architectures of them."""

from __future__ import annotations

import os
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any, ClassVar

from regraft import Component, Input, Output, Parameter, Quality
from regraft.bus_schema.annotations import PlainValue
from regraft.bus_schema.messages.geometry import Twist
from regraft.bus_schema.model.architecture import ComponentSpec
from regraft.component.component import InputQualities, class_path, describe
from regraft.stack.classes import describe_class


class Source(Component):
    """Gives what its parameter has."""

    made = Output(Twist)
    rate = Parameter(10.0, minimum=0.0, maximum=1000.0, unit="Hz")
    flow = Quality(unit="Hz", better="higher", minimum=0.0)
    seen = Quality(unit="Hz", estimated=False)

    @classmethod
    def estimate(cls, parameters: dict[str, PlainValue], context: dict[str, PlainValue]) -> dict[str, float]:
        """Return the rate, which the context may scale."""
        return {"flow": parameters["rate"] * context.get("scale", 1.0)}


class Filter(Component):
    """Lets half of what comes through."""

    taken = Input(Twist, required=False)
    unread = Input(Twist, required=False)
    given = Output(Twist)
    share = Parameter(0.5, minimum=0.0, maximum=1.0)
    flow = Quality(unit="Hz", better="higher", minimum=0.0)

    calls: ClassVar[list[str]] = []

    @classmethod
    def estimate_from_inputs(
        cls, parameters: dict[str, PlainValue], context: dict[str, PlainValue], inputs: InputQualities
    ) -> dict[str, float]:
        """Return the share of what feeds it."""
        flow = inputs["taken"].get("flow")
        return {} if flow is None else {"flow": parameters["share"] * flow}


class Round(Component):
    """Has its robot's size, and knows whether its file is there."""

    made = Output(Twist)
    largest = Parameter(0.22, read_only=True, from_robot="radius")
    radius = Parameter(0.22, limit="largest", from_robot="radius")
    file = Parameter("", unit="path", exists=True)
    size = Quality(unit="m", better="lower")

    @classmethod
    def estimate(cls, parameters: dict[str, PlainValue], context: dict[str, PlainValue]) -> dict[str, float]:
        """Return the radius, by 10 m more with a file."""
        return {"size": parameters["radius"] + 10.0 * Path(parameters["file"] or "nothing").is_file()}


class Raising(Source):
    """Cannot estimate."""

    @classmethod
    def estimate(cls, parameters: dict[str, PlainValue], context: dict[str, PlainValue]) -> dict[str, float]:
        """Raise."""
        raise RuntimeError("no idea")


class Exiting(Source):
    """Ends the process that asks it."""

    @classmethod
    def estimate(cls, parameters: dict[str, PlainValue], context: dict[str, PlainValue]) -> dict[str, float]:
        """End at once."""
        os._exit(3)


class Leaving(Source):
    """Leaves politely."""

    @classmethod
    def estimate(cls, parameters: dict[str, PlainValue], context: dict[str, PlainValue]) -> dict[str, float]:
        """Raise SystemExit."""
        raise SystemExit(3)


class Hanging(Source):
    """Never comes back, and holds on to all that is thrown at it."""

    @classmethod
    def estimate(cls, parameters: dict[str, PlainValue], context: dict[str, PlainValue]) -> dict[str, float]:
        """Loop for ever."""
        while True:
            try:
                time.sleep(60.0)
            except Exception:
                continue


def spec(cls: type[Component], name: str, connect: Mapping[str, str] | None = None, **more: Any) -> ComponentSpec:
    """Return a component of an architecture."""
    return ComponentSpec(name, class_path(cls), connections=dict(connect or {}), description=describe(cls), **more)


def architecture(*specs: ComponentSpec) -> dict[str, ComponentSpec]:
    """Return components by name."""
    return {each.name: each for each in specs}


def described(spec: ComponentSpec) -> ComponentSpec:
    """Return a spec with what its class says."""
    description, _ = describe_class(spec.cls, spec.parameters)
    return ComponentSpec(
        spec.name, spec.cls, parameters=spec.parameters, connections=spec.connections, description=description
    )
