"""The bodies that several routes take: an adaptation, and the changes of a component that the path names."""

from __future__ import annotations

from typing import Annotated, Any

from fastapi import Body
from pydantic import conlist

from regraft.bus_schema.annotations import Count, PlainValue
from regraft.bus_schema.encoding.records import shape_of
from regraft.bus_schema.model.adaptation import AdaptationRequest, Change, ChangeState, Move, Swap
from regraft.dashboard_api.http.bus_types import BodyField, Fields, JsonObject, Values, checked, fields_of

MAX_CHANGES = 1000
ADAPTATION_EXAMPLES = {
    "tune and rewire": {
        "summary": "drive slower, and look through another camera",
        "value": {
            "reason": "someone is near",
            "changes": [
                {"change": "set_parameters", "component": "navigator", "parameters": {"max_velocity": 0.18}},
                {"change": "connect", "component": "detector", "port": "image", "topic": "corner_camera/image"},
            ],
        },
    },
    "add": {
        "summary": "a second detector, which writes a topic of its own",
        "value": {
            "reason": "two see more than one",
            "changes": [
                {
                    "change": "add",
                    "component": "second_detector",
                    "spec": {
                        "class": "regraft.services.detector.detector:Detector",
                        "parameters": {"interval": 1.0},
                        "connect": {
                            "image": "corner_camera/image",
                            "detections": "corner_detections",
                            "energy": "corner_energy",
                        },
                        "services": {"detect": "corner_detect"},
                    },
                    "topics": [
                        {"name": "corner_detections", "type": "regraft/Detections"},
                        {"name": "corner_energy", "type": "regraft/EnergyUse"},
                    ],
                }
            ],
        },
    },
    "swap": {
        "summary": "another detector, with a parameter that the one of before does not have",
        "value": {
            "reason": "it needs less energy",
            "changes": [
                {
                    "change": "swap",
                    "component": "detector",
                    "class": "regraft.services.detector.template_detector:TemplateDetector",
                }
            ],
        },
    },
    "remove": {
        "summary": "the second detector, and its topics",
        "value": {
            "reason": "one is enough",
            "changes": [
                {
                    "change": "remove",
                    "component": "second_detector",
                    "topics": ["corner_detections", "corner_energy"],
                }
            ],
        },
    },
}


def example(value: Any, **more: Any) -> Any:
    """Return a body parameter with an example."""
    return Body(openapi_examples={"example": {"value": value}}, **more)


REASON = fields_of(AdaptationRequest, "reason")
CHANGES = conlist(checked(shape_of(Change)), min_length=1, max_length=MAX_CHANGES)
CONFIRMATION = fields_of(
    AdaptationRequest,
    "confirm",
    "watch",
    also={
        "confirm": {
            "description": "Seconds for which it is watched before it is final, and undone if it does not hold"
        },
        "watch": {"description": "What must hold meanwhile: requirements by name, qualities, states, expressions"},
    },
)
ADAPTATION = {
    "changes": BodyField("changes", CHANGES, required=True),
    **REASON,
    "revision": BodyField("revision", checked(shape_of(Count))),
    **fields_of(
        AdaptationRequest,
        "context",
        also={"context": {"description": "What is so in the world, for readers of the journal"}},
    ),
    **CONFIRMATION,
}


def of_component(cls: type) -> Fields:
    """Return the body of a change of a component that the path names."""
    return Fields(f"{cls.__name__}Body", fields_of(cls, without=["component"]) | REASON | CONFIRMATION)


AdaptationBody = Annotated[JsonObject, Fields("AdaptationBody", ADAPTATION), Body(openapi_examples=ADAPTATION_EXAMPLES)]
TransitionBody = Annotated[
    JsonObject, of_component(ChangeState), example({"transition": "deactivate", "reason": "dark"})
]
SwapBody = Annotated[
    JsonObject,
    of_component(Swap),
    example({"class": "regraft.services.detector.template_detector:TemplateDetector", "parameters": {"interval": 1.0}}),
]
MoveBody = Annotated[JsonObject, of_component(Move), example({"host": "second", "reason": "more room to compute"})]
UndoBody = Annotated[
    JsonObject,
    Fields("UndoBody", REASON | CONFIRMATION),
    example({"reason": "it was better before"}, default_factory=dict),
]
ParametersBody = Annotated[JsonObject, Values(shape_of(PlainValue)), example({"max_velocity": 0.18})]
NoBody = Annotated[JsonObject, Fields("NoBody"), example({}, default_factory=dict)]
