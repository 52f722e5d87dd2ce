"""A class that handles what its base only declares does so for itself alone."""

from __future__ import annotations

from collections.abc import Callable

from regraft import Component, Input
from regraft.testing import Rig
from tests.kit.parts import Number


class Base(Component):
    """Only declares an input."""

    heard = Input(Number)

    def __init__(self) -> None:
        self.calls: list[str] = []


class Left(Base):
    """Handles it in one way."""

    @Base.heard.handler
    def look(self, _: Number) -> None:
        self.calls.append("look")


class Right(Base):
    """Handles it in another way."""

    @Base.heard.handler
    def see(self, _: Number) -> None:
        self.calls.append("see")


class Further(Right):
    """Overrides the method, and need not declare that again."""

    def see(self, _: Number) -> None:
        self.calls.append("further")


class Anew(Right):
    """Has an input of its own in the place of its base's."""

    heard = Input(Number)


def test_each_class_handles_an_inherited_input_in_its_own_way() -> None:
    expected = {Base: [], Left: ["look"], Right: ["see"], Further: ["further"], Anew: []}
    for cls, calls in expected.items():
        with Rig() as rig:
            component = rig.add(cls)
            rig.publish("heard", Number(1))
            assert component.calls == calls, cls


def counted(function: Callable[..., None]) -> Callable[..., None]:
    """Wrap a method as many a decorator does, without its name and marks."""

    def call(*values: object) -> None:
        function(*values)

    return call


class Wrapped(Component):
    """Has a decorator outside of that of the handler."""

    heard = Input(Number)

    def __init__(self) -> None:
        self.calls = 0

    @counted
    @heard.handler
    def count(self, _: Number) -> None:
        self.calls += 1


def test_a_handler_may_have_other_decorators() -> None:
    with Rig() as rig:
        component = rig.add(Wrapped)
        rig.publish("heard", Number(1))
        assert component.calls == 1
