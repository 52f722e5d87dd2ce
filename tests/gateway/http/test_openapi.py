from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import pytest
from fastapi.openapi.models import OpenAPI
from jsonschema import Draft202012Validator

from tests.gateway.conftest import Running

METHODS = ("get", "post", "patch", "delete", "put")


@pytest.fixture(scope="module")
def document(shared: Running) -> dict[str, Any]:
    document: dict[str, Any] = shared.http.get("/openapi.json").json()
    return document


def operations(document: dict[str, Any]) -> Iterator[tuple[str, str, dict[str, Any]]]:
    for path, item in document["paths"].items():
        for method in METHODS:
            if method in item:
                yield path, method, item[method]


def references(node: Any) -> Iterator[str]:
    if isinstance(node, dict):
        if isinstance(node.get("$ref"), str):
            yield node["$ref"]
        node = list(node.values())
    if isinstance(node, list):
        for item in node:
            yield from references(item)


def whole(document: dict[str, Any], content: dict[str, Any]) -> dict[str, Any]:
    """Return the schema of a content, with all that it refers to."""
    schema: dict[str, Any] = content["schema"]
    name = schema.get("$ref", "").rpartition("/")[2]
    return {**(document["components"]["schemas"][name] if name else schema), "components": document["components"]}


def test_the_document_is_valid(document: dict[str, Any]) -> None:
    assert document["openapi"].startswith("3.1")
    OpenAPI.model_validate(document)
    for schema in document["components"]["schemas"].values():
        Draft202012Validator.check_schema(schema)


def test_every_reference_leads_somewhere(document: dict[str, Any]) -> None:
    known = {f"#/components/schemas/{name}" for name in document["components"]["schemas"]}
    assert set(references(document)) == known


def test_every_route_says_what_it_does_and_shows(document: dict[str, Any]) -> None:
    for path, method, operation in operations(document):
        assert operation["description"], f"{method} {path}"
        assert operation["tags"]
        good = next(answer for status, answer in operation["responses"].items() if status in ("200", "201"))
        for media_type in good["content"].values():
            assert media_type.get("schema") or media_type["itemSchema"], f"{method} {path}"


def test_every_route_declares_its_problems(document: dict[str, Any]) -> None:
    for path, method, operation in operations(document):
        declared = operation["responses"]
        wanted = {"403", "421", "500"}
        if method in ("post", "patch"):
            wanted |= {"413", "415", "422", "503"}
            # Asking for qualities touches nothing; a proposal tells of a conflict itself, by its report.
            if not path.endswith(("/qualities", "/propose")):
                wanted.add("409")
        if "{" in path:
            wanted |= {"404", "422"}
        if operation.get("parameters"):
            wanted.add("422")
        assert wanted <= declared.keys(), f"{method} {path}"
        for status, answer in declared.items():
            if status >= "400":
                assert answer["content"].keys() == {"application/problem+json"}, f"{method} {path} {status}"


def test_every_acting_route_names_its_role_and_says_how_to_prove_who_asks(document: dict[str, Any]) -> None:
    scheme = document["components"]["securitySchemes"]["bearer"]
    assert (scheme["type"], scheme["scheme"]) == ("http", "bearer")
    for path, method, operation in operations(document):
        acts = method != "get" and not path.endswith("/qualities")
        assert (operation.get("x-regraft-role") in ("operate", "administer")) is acts, f"{method} {path}"
        assert (operation.get("security") == [{"bearer": []}, {}]) is acts
        assert ("401" in operation["responses"]) is acts
        if acts:
            assert f"Needs the role `{operation['x-regraft-role']}`" in operation["description"]
            assert "WWW-Authenticate" in operation["responses"]["401"]["headers"]


def test_examples_are_valid_bodies(document: dict[str, Any]) -> None:
    shown = 0
    for path, method, operation in operations(document):
        for body in operation.get("requestBody", {}).get("content", {}).values():
            for example in body["examples"].values():
                Draft202012Validator(whole(document, body)).validate(example["value"])
            shown += 1
        assert (method == "get") or "requestBody" in operation or method == "delete", path
    assert shown == 23


def test_the_document_describes_every_change(document: dict[str, Any]) -> None:
    body = document["paths"]["/api/v1/adaptations"]["post"]["requestBody"]["content"]["application/json"]
    changes = whole(document, body)["properties"]["changes"]
    kinds = {member["properties"]["change"]["const"] for member in changes["items"]["oneOf"]}
    assert kinds >= {"set_parameters", "connect", "transition", "add", "remove", "swap", "move", "mode"}
