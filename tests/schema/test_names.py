"""One vocabulary: names under which fields travel, and what becomes of former ones."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import pytest

from regraft.bus_schema.annotations import Named
from regraft.bus_schema.encoding import codec
from regraft.bus_schema.encoding.records import record_shape
from regraft.bus_schema.errors import BadMessage, BadType
from regraft.bus_schema.model.adaptation import AdaptationRequest, Swap
from regraft.bus_schema.model.architecture import ComponentSpec
from regraft.bus_schema.model.description import Description

SWAP = {"change": "swap", "component": "detector"}


def test_a_request_says_class_and_connect_as_a_stack_file_does() -> None:
    request = AdaptationRequest(
        (Swap("detector", "regraft.services.detector:Detector", connections={"image": "corner"}),)
    )
    (change,) = codec.to_plain(request)["changes"]
    assert (change["class"], change["connect"]) == ("regraft.services.detector:Detector", {"image": "corner"})
    assert codec.from_plain({"changes": [change]}, AdaptationRequest) == request


@pytest.mark.parametrize(
    ("kind", "plain", "where", "present"),
    [
        (AdaptationRequest, {"changes": [{**SWAP, "cls": "a:B"}]}, ("changes", "0"), "class"),
        (AdaptationRequest, {"changes": [{**SWAP, "connections": {}}]}, ("changes", "0"), "connect"),
        (AdaptationRequest, {"changes": [], "who": "me"}, (), "actor"),
        (ComponentSpec, {"cls": "a:B"}, (), "class"),
        (Description, {"cls": "a:B", "text": "does things"}, ("class",), "class"),
        (Description, {"class": "a:B", "text": "does things"}, ("description",), "description"),
        (Description, {"class": "a:B", "description": "", "longest_handler": 1.0}, (), "handler_timeout"),
        (Description, {"class": "a:B", "description": "", "makes_time": True}, (), "is_time_source"),
        (Description, {"class": "a:B", "description": "", "indispensable": "x"}, (), "removal_forbidden"),
        (Description, {"class": "a:B", "description": "", "in_step": True}, (), "lockstep"),
    ],
)
def test_a_former_name_is_refused_with_the_present_one(
    kind: type, plain: dict[str, object], where: tuple[str, ...], present: str
) -> None:
    with pytest.raises(BadMessage, match=f"it is called '{present}'") as refused:
        record_shape(kind).unpack(plain)
    assert refused.value.where == where


def test_two_fields_cannot_travel_under_one_name() -> None:
    @dataclass(frozen=True, slots=True)
    class Twice:
        one: Annotated[int, Named("two")]
        two: int

    with pytest.raises(BadType, match="two fields"):
        record_shape(Twice)
