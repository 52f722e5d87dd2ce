"""Types are registered once, under one name, and only if all their fields can travel."""

from __future__ import annotations

import math
from dataclasses import InitVar, dataclass, field
from enum import Enum, IntEnum
from typing import Annotated, Any, ClassVar

import numpy as np
import pytest
from numpy.typing import NDArray

from regraft.bus_schema.annotations import Array, Bounds, MayBeInfinite, OneOf, Tagged, Text
from regraft.bus_schema.encoding import codec, registry
from regraft.bus_schema.encoding.registry import known_types, message, type_named, type_of
from regraft.bus_schema.errors import BadMessage, BadType
from regraft.bus_schema.messages.geometry import Twist, Vector3
from regraft.bus_schema.messages.health import Event
from regraft.bus_schema.messages.sensors import Image

Tail = Annotated[NDArray[np.uint8], Array("|u1", (None,), tail=True)]


@pytest.fixture(autouse=True)
def forget_types_of_the_test(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(registry, "_types", dict(registry._types))
    monkeypatch.setattr(registry, "_by_class", dict(registry._by_class))


@dataclass(frozen=True, slots=True)
class Bare:
    x: float


def registered(hint: Any, name: str = "tests/Holder") -> Any:
    holder: Any = dataclass(frozen=True)(
        type("Holder", (), {"__annotations__": {"field": hint}, "__module__": __name__})
    )
    return message(name)(holder)


def test_a_type_is_found_by_its_name_and_by_its_class() -> None:
    assert type_named("regraft/Twist") is type_of(Twist)
    assert type_of(Twist) in known_types()


def test_the_encoding_says_type_version_and_whether_there_is_a_tail() -> None:
    assert type_of(Twist).encoding == "application/msgpack;regraft/Twist@1"
    assert type_of(Image).encoding == "application/x-msgpack-tail;regraft/Image@1"


def test_an_unknown_name_is_refused_with_the_known_ones() -> None:
    with pytest.raises(BadType, match=r"tests/Nobody.*regraft/Twist"):
        type_named("tests/Nobody")


def test_a_class_without_a_name_is_no_message() -> None:
    with pytest.raises(BadType, match="Bare is not a message"):
        type_of(Bare)


@pytest.mark.parametrize("name", ["Twist", "regraft/twist", "Regraft/Twist", "a/b/C", "regraft/", "re graft/Twist"])
def test_an_ill_formed_name_is_refused(name: str) -> None:
    with pytest.raises(BadType, match="package/TypeName"):
        message(name)(Bare)


def test_a_name_belongs_to_one_class() -> None:
    with pytest.raises(BadType, match=r"already regraft\.bus_schema"):
        message("regraft/Twist")(Bare)
    assert type_named("regraft/Twist").cls is Twist


def test_a_class_has_one_name() -> None:
    message("tests/Bare")(Bare)
    with pytest.raises(BadType, match="tests/Bare"):
        message("tests/Other")(Bare)


def test_a_module_that_is_loaded_again_may_register_its_types_again() -> None:
    message("tests/Bare")(Bare)
    message("tests/Bare")(Bare)
    assert type_named("tests/Bare").cls is Bare


@pytest.mark.parametrize(
    "hint",
    [
        complex,
        set[int],
        list[float],
        dict[int, str],
        tuple[int, str],
        int | str,
        NDArray[np.uint8],
        object,
        Bare | Vector3,
        Enum("Gear", {"PARK": 0, "DRIVE": 1}),
        IntEnum("Step", {"UP": 1, "DOWN": -1}),
        Enum("Mixed", {"TEXT": "text", "NUMBER": 1}),
        Annotated[bool, Bounds(minimum=0.0)],
        Annotated[str, Bounds(minimum=0.0)],
        Annotated[tuple[bytes, ...], Text(3)],
        Annotated[dict[str, int], MayBeInfinite()],
        Annotated[float, OneOf(())],
        Annotated[NDArray[np.complex64], Array("<c8", (None,))],
        Annotated[NDArray[np.float32], Array(">f4", (None,))],
        Annotated[NDArray[np.float32], Array("flaot32", (None,))],
        Annotated[NDArray[np.float32], Array("<f4", ())],
        Annotated[float, Array("<f4", (3,))],
    ],
)
def test_a_field_that_cannot_travel_is_refused_by_name(hint: Any) -> None:
    with pytest.raises(BadType, match=r"Holder\.field"):
        registered(hint)


@pytest.mark.parametrize(
    ("hint", "fits", "misfit", "where"),
    [
        (Annotated[tuple[float, ...], Bounds(minimum=0.0)], (1.0,), (1.0, -5.0), ("field", "1")),
        (Annotated[dict[str, int], Bounds(maximum=3)], {"a": 3}, {"a": 4}, ("field", "a")),
        (Annotated[tuple[str, ...], Text(3)], ("abc",), ("abcd",), ("field", "0")),
        (Annotated[tuple[float, ...] | None, MayBeInfinite()], (math.inf,), (math.nan,), ("field", "0")),
    ],
)
def test_what_holds_for_several_values_holds_for_each(hint: Any, fits: Any, misfit: Any, where: Any) -> None:
    holder = registered(hint)
    assert codec.decode(codec.encode(holder(fits)), holder) == holder(fits)
    with pytest.raises(BadMessage) as refused:
        codec.encode(holder(misfit))
    assert refused.value.where == where


def test_an_array_may_be_left_out_wherever_its_layout_stands() -> None:
    layout = Array("<f4", (None,))
    for hint in (Annotated[NDArray[np.float32] | None, layout], Annotated[NDArray[np.float32], layout] | None):
        holder = registered(hint)
        assert codec.decode(codec.encode(holder(None)), holder).field is None
        full = codec.decode(codec.encode(holder(np.ones(2, np.float32))), holder)
        assert full.field.tolist() == [1.0, 1.0]
        registry._types.pop("tests/Holder")


@dataclass(frozen=True, slots=True)
class Computed:
    a: float
    norm: float = field(init=False)


@dataclass(frozen=True)
class Asking:
    a: float
    unit: InitVar[str]


@pytest.mark.parametrize("cls", [Computed, Asking])
def test_a_class_that_its_fields_do_not_make_is_refused(cls: type) -> None:
    with pytest.raises(BadType, match="__init__"):
        message("tests/Unmade")(cls)


@dataclass(frozen=True, init=False)
class Lenient:
    a: float

    def __init__(self, *more: float, **values: float) -> None:
        object.__setattr__(self, "a", values["a"])


def test_a_class_that_takes_any_values_can_be_made_of_its_fields() -> None:
    message("tests/Lenient")(Lenient)
    assert codec.decode(codec.pack_plain({"a": 2.0}), Lenient).a == 2.0


@dataclass(frozen=True, slots=True)
class Picky:
    """Checks itself, and fails at that."""

    number: int

    def __post_init__(self) -> None:
        assert 1 / self.number


def test_whatever_a_class_raises_readers_get_that_the_message_is_bad() -> None:
    message("tests/Picky")(Picky)
    with pytest.raises(BadMessage, match="ZeroDivisionError"):
        codec.decode(codec.pack_plain({"number": 0}), Picky)
    with pytest.raises(BadMessage, match="ZeroDivisionError"):
        codec.from_plain({"number": 0}, Picky)


class Gear(str, Enum):  # noqa: UP042 (authors write it so, and a StrEnum has another text)
    """As many write it: its text is ``Gear.LOW``, its value is not."""

    LOW = "low"


def test_a_member_of_texts_travels_by_its_value() -> None:
    event = Event(0.0, Gear.LOW, "s", "t", {"gear": Gear.LOW, Gear.LOW: [Gear.LOW]})
    arrived = codec.decode(codec.encode(event), Event)
    assert (arrived.kind, arrived.details) == ("low", {"gear": "low", "low": ["low"]})


def test_a_message_has_at_most_one_tail() -> None:
    @dataclass(frozen=True, slots=True)
    class TwoTails:
        one: Tail
        other: Tail

    holder = TwoTails
    holder.__annotations__ = {"one": Tail, "other": Tail}
    with pytest.raises(BadType, match="2 tail arrays"):
        message("tests/TwoTails")(holder)


@pytest.mark.parametrize("hint", [Image, Image | None, tuple[Image, ...], dict[str, Image]])
def test_a_tail_within_a_field_is_refused(hint: Any) -> None:
    with pytest.raises(BadType, match="tail"):
        registered(hint)


@dataclass(frozen=True, slots=True)
class Untagged:
    x: float


@dataclass(frozen=True, slots=True)
class TagIsField:
    kind: ClassVar[str] = "a"


@dataclass(frozen=True, slots=True)
class SameTag:
    kind: ClassVar[str] = "b"


@dataclass(frozen=True, slots=True)
class SameTagAgain:
    kind: ClassVar[str] = "b"


def test_the_members_of_a_union_have_tags_of_their_own() -> None:
    with pytest.raises(BadType, match="has the tag 'b'"):
        registered(Annotated[SameTag | SameTagAgain, Tagged("kind")])


def test_a_member_of_a_union_must_hold_its_tag() -> None:
    with pytest.raises(BadType, match="no ClassVar"):
        registered(Annotated[Untagged | TagIsField, Tagged("kind")])
