"""The OpenAPI document: what FastAPI makes of the routes, with our schemas, and the role that each of them needs."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final

from fastapi.openapi.utils import get_openapi
from starlette.routing import BaseRoute

from regraft.bus_schema.encoding.records import record_shape
from regraft.dashboard_api.http.problems import ProblemDetails, declared
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
    # FastAPI would have the models of responses be JSON, which problems are not quite: application/problem+json.
    document["components"]["schemas"]["ProblemDetails"] = record_shape(ProblemDetails).json_schema()
    document["components"]["securitySchemes"] = SCHEME
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
        operation["responses"]["401"] = declared(401)[401] | {"headers": challenge}
    return document
