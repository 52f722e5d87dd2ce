"""Checks every answer against the API's own document: declared status, declared body."""

from __future__ import annotations

import re
from typing import Any

import httpx
from jsonschema import Draft202012Validator

_document: dict[str, Any] = {}


def contract(http: httpx.Client) -> Contract:
    """Return the document of a gateway as a judge; all gateways have the same, so the first one alone is asked."""
    if not _document:
        _document.update(http.get("/openapi.json").json())
    return Contract(_document)


class Contract:
    """The OpenAPI document, as a judge of answers."""

    def __init__(self, document: dict[str, Any]) -> None:
        self.document = document
        self._routes = [
            (re.compile(re.sub(r"\{[^}]+\}", "[^/]+", path) + "$"), operations)
            for path, operations in document["paths"].items()
        ]

    def check(self, response: httpx.Response) -> None:
        """Fail if a route answered with what it does not declare."""
        path, asked = response.request.url.path, response.request.method.lower()
        method = "get" if asked == "head" else asked
        operations = next((ops for pattern, ops in self._routes if pattern.match(path)), None)
        if operations is None or method not in operations:
            assert response.status_code in (403, 404, 405, 413, 421) or path.endswith(("/openapi.json", ".html"))
            return
        declared = operations[method]["responses"]
        assert str(response.status_code) in declared, f"{method} {path} does not declare {response.status_code}"
        media_type = response.headers.get("content-type", "").partition(";")[0]
        content = declared[str(response.status_code)].get("content", {})
        assert media_type in content or not content, f"{media_type} is not declared"
        if media_type.endswith("json") and asked != "head":
            response.read()
            schema = {**content[media_type]["schema"], "components": self.document["components"]}
            Draft202012Validator(schema).validate(response.json())
