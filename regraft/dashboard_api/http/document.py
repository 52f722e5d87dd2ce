"""The OpenAPI document: what FastAPI makes of the routes, with our schemas, and the role that each of them needs."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final

from fastapi.openapi.utils import get_openapi
from starlette.routing import BaseRoute

from regraft.bus_schema.encoding.shapes import INT_RANGE
from regraft.dashboard_api.http import problems
from regraft.dashboard_api.http.json_replies import schemas
from regraft.dashboard_api.http.roles import BY_BODY, BY_BODY_TEXT, ROLES

DESCRIPTION: Final = """Shows a running robot system and takes adaptations.

Whatever changes the architecture is an adaptation: checked as a whole, carried out as a transaction, journalled.
Every error is a problem (RFC 9457) that names all violations.

Reading is open to every user of this machine. Acting needs a role: the user that runs the gateway, and root, have all
of them; others show a token."""
ROLE: Final = "x-regraft-role"
"""The field of an operation that holds its role."""
SCHEME: Final = {
    "bearer": {
        "type": "http",
        "scheme": "bearer",
        "description": "A token of `regraft token create`. The user that runs the gateway, and root, need none.",
    }
}


def openapi_document(routes: Sequence[BaseRoute], prefix: str) -> dict[str, Any]:
    """Return the document for an application's routes, of which ours begin with ``prefix``."""
    document = get_openapi(title="Regraft", version="1", description=DESCRIPTION, routes=routes)
    document["components"] = {
        "schemas": {**schemas(), "ProblemDetails": problems.schema()},
        "securitySchemes": SCHEME,
    }
    _bound_integers(document["paths"])
    for operations in document["paths"].values():
        for operation in operations.values():
            for parameter in operation.get("parameters", ()):
                parameter["schema"] = _as_sent(parameter["schema"])
    for (method, path), role in ROLES.items():
        operation = document["paths"].get(prefix + path, {}).get(method.lower())
        if operation is None or role is None:
            continue
        operation[ROLE] = role.value
        # Either is enough: a token, or to be the right user of this machine.
        operation["security"] = [{"bearer": []}, {}]
        more = f", and {BY_BODY_TEXT}" if (method, path) in BY_BODY else ""
        operation["description"] += f"\n\nNeeds the role `{role.value}`{more}."
        challenge = {"WWW-Authenticate": {"description": "`Bearer`", "schema": {"type": "string"}}}
        operation["responses"]["401"] = problems.declared(401)[401] | {"headers": challenge}
    return document


def _bound_integers(part: Any) -> None:
    """Say of every integer in a part of the document that it fits 64 bits."""
    if isinstance(part, list):
        for each in part:
            _bound_integers(each)
    elif isinstance(part, dict):
        if part.get("type") == "integer":
            part.setdefault("minimum", INT_RANGE[0])
            part.setdefault("maximum", INT_RANGE[-1])
        for each in part.values():
            _bound_integers(each)


def _as_sent(schema: dict[str, Any]) -> dict[str, Any]:
    """Return the schema of a header or query parameter: one that is optional is left out, and never null."""
    choices = [choice for choice in schema.get("anyOf", ()) if choice != {"type": "null"}]
    if len(choices) != 1:
        return schema
    sent: dict[str, Any] = choices[0]
    return {key: value for key, value in schema.items() if key != "anyOf"} | sent
