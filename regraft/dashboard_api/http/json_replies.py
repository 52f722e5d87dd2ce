"""Dataclasses as JSON answers, and their schemas for OpenAPI: the shapes of the bus do both."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from starlette.responses import JSONResponse, Response

from regraft.bus_schema.encoding.records import record_shape
from regraft.client import as_json

_shown: set[type] = set()


def to_json(value: Any) -> Any:
    """Return a dataclass, a message or a view of this API, as JSON values; raises BadMessage."""
    cls: Any = type(value)
    return as_json(record_shape(cls).pack(value))


def reply(value: Any, status: int = 200, headers: Mapping[str, str] | None = None) -> Response:
    """Return a dataclass as the answer to a request."""
    return JSONResponse(to_json(value), status, dict(headers or {}))


def shown(cls: type, description: str, status: int = 200) -> dict[int | str, dict[str, Any]]:
    """Return, for OpenAPI, the answer of a route that shows ``cls``."""
    content = {"application/json": {"schema": ref(cls)}}
    return {status: {"description": description, "content": content}}


def ref(cls: type) -> dict[str, str]:
    """Return a reference to the schema of ``cls``, which ``schemas`` then holds."""
    _shown.add(cls)
    return {"$ref": f"#/components/schemas/{cls.__name__}"}


def schemas() -> dict[str, Any]:
    """Return the JSON Schemas of all that was referred to, by name."""
    return {cls.__name__: record_shape(cls).json_schema() for cls in sorted(_shown, key=lambda c: c.__name__)}
