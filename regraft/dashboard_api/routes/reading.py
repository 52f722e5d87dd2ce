"""Reads an adaptation from a body, telling everything that does not fit, change by change."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, TypeVar

from regraft.bus_schema.annotations import Count, PlainValue
from regraft.bus_schema.encoding.records import record_shape, shape_of
from regraft.bus_schema.errors import BadMessage
from regraft.bus_schema.model.adaptation import AdaptationRequest, Change, Violation
from regraft.dashboard_api.http.adaptation_headers import AdaptationHeaders
from regraft.dashboard_api.http.body import told, unknown_fields
from regraft.dashboard_api.http.problems import malformed, violation

FIELDS = ("changes", "reason", "revision", "context", "confirm", "watch")
MAX_REASON_LENGTH = 1000
MAX_CHANGES = 1000
CHANGE = shape_of(Change)
REVISION = shape_of(Count)
REASON = dict(record_shape(AdaptationRequest).fields)["reason"]
CONTEXT = dict(record_shape(AdaptationRequest).fields)["context"]
CONFIRM = dict(record_shape(AdaptationRequest).fields)["confirm"]
WATCH = dict(record_shape(AdaptationRequest).fields)["watch"]


@dataclass(frozen=True, slots=True)
class Examples:
    """Several examples of a body, as OpenAPI has them: by name, each with its ``summary`` and ``value``."""

    by_name: dict[str, Any]


ADAPTATION_EXAMPLES = Examples(
    {
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
)

V = TypeVar("V")


def adaptation_schema() -> dict[str, Any]:
    """Return the JSON Schema of an adaptation as it is asked for here."""
    return _object_schema(
        {
            "changes": {
                "type": "array",
                "items": CHANGE.json_schema(),
                "minItems": 1,
                "maxItems": MAX_CHANGES,
            },
            "reason": REASON.json_schema(),
            "revision": REVISION.json_schema(),
            "context": CONTEXT.json_schema() | {"description": "What is so in the world, for readers of the journal"},
            "confirm": CONFIRM.json_schema()
            | {"description": "Seconds for which it is watched before it is final, and undone if it does not hold"},
            "watch": WATCH.json_schema() | {"description": "Quality requirements that must hold meanwhile, by name"},
        },
        ["changes"],
    )


def reason_schema() -> dict[str, Any]:
    """Return the JSON Schema of a body that only gives a reason."""
    return _object_schema({"reason": REASON.json_schema()}, [])


def short_form(cls: type) -> dict[str, Any]:
    """Return the JSON Schema of a body that stands for a change of a component that the path names."""
    schema = record_shape(cls).json_schema()
    properties = {name: shown for name, shown in schema["properties"].items() if name not in ("change", "component")}
    required = [name for name in schema.get("required", ()) if name in properties]
    return _object_schema({**properties, "reason": REASON.json_schema()}, required)


def _object_schema(properties: dict[str, Any], required: list[str]) -> dict[str, Any]:
    schema = {"type": "object", "properties": properties, "additionalProperties": False}
    return {**schema, "required": required} if required else schema


def read_adaptation(body: dict[str, Any], asked: AdaptationHeaders) -> AdaptationRequest:
    """Return the adaptation that a body describes; raises Problem with every violation."""
    wrong: list[Violation] = unknown_fields(body, FIELDS)
    changes = _changes(body.get("changes"), wrong)
    reason = _read("reason", body.get("reason", ""), REASON.unpack, wrong)
    seen = _read("revision", body["revision"], REVISION.unpack, wrong) if "revision" in body else None
    context = _read("context", body.get("context", {}), CONTEXT.unpack, wrong)
    confirm = _read("confirm", body.get("confirm", 0.0), CONFIRM.unpack, wrong)
    watch = _read("watch", body.get("watch", []), WATCH.unpack, wrong)
    if seen is not None and asked.revision is not None and seen != asked.revision:
        wrong.append(violation("revision", f"is {seen}, but If-Match says {asked.revision}"))
    if wrong:
        raise malformed(*wrong)
    revision = asked.revision if asked.revision is not None else seen
    found = request(tuple(changes), reason or "", revision, asked, context)
    return replace(found, confirm=confirm or 0.0, watch=tuple(watch or ()))


def request(
    changes: tuple[Any, ...],
    reason: str,
    revision: int | None,
    asked: AdaptationHeaders,
    context: dict[str, PlainValue] | None = None,
) -> AdaptationRequest:
    """Return an adaptation under the request's headers; raises Problem if its context is too large."""
    try:
        return AdaptationRequest(
            changes,
            reason,
            asked.actor,
            revision,
            asked.key,
            dry_run=asked.dry_run,
            wait=asked.wait,
            context=context or {},
        )
    except BadMessage as error:
        raise malformed(told(error)) from None


def read_change(plain: dict[str, Any]) -> Any:
    """Return the one change that a route stands for; raises Problem."""
    try:
        return CHANGE.unpack(plain)
    except BadMessage as error:
        raise malformed(told(error)) from None


def read_reason(body: dict[str, Any]) -> str:
    """Return the reason that a body gives, empty without one; raises Problem."""
    wrong: list[Violation] = []
    reason = _read("reason", body.get("reason", ""), REASON.unpack, wrong)
    if wrong:
        raise malformed(*wrong)
    return str(reason)


def _changes(plain: Any, wrong: list[Violation]) -> list[Any]:
    if not isinstance(plain, list) or not 0 < len(plain) <= MAX_CHANGES:
        wrong.append(violation("changes", f"must be a list of 1 to {MAX_CHANGES} changes"))
        return []
    changes = []
    for index, item in enumerate(plain):
        try:
            changes.append(CHANGE.unpack(item))
        except BadMessage as error:
            wrong.append(told(error, f"changes.{index}", change=index))
    return changes


def _read(field: str, plain: Any, unpack: Callable[[Any], V], wrong: list[Violation]) -> V | None:
    try:
        return unpack(plain)
    except BadMessage as error:
        wrong.append(told(error, field))
        return None
