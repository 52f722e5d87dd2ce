"""The OpenAPI document as HTML: each route with its role, parameters, body and answers, then the schemas."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from html import escape
from typing import Any, Final

from regraft.dashboard_api.http.document import ROLE
from regraft.dashboard_api.routes.html import code, link

METHODS: Final = ("get", "post", "put", "patch", "delete")
REFERENCE: Final = re.compile(r"&quot;#/components/schemas/(\w+)&quot;")


def openapi_page(document: dict[str, Any], prefix: str) -> str:
    """Return the body of the page that shows a document."""
    operations = [
        (method.upper(), path, item[method])
        for path, item in document["paths"].items()
        for method in METHODS
        if method in item
    ]
    parts = [
        f"<h1>{escape(document['info']['title'])} API</h1>",
        _prose(document["info"]["description"]),
        f"<p>{link(prefix, 'what is there')}, {link(prefix + '/openapi.json', 'the same for programs')}</p>",
        _contents(operations),
        *(_operation(*operation) for operation in operations),
        "<h2>Schemas</h2>",
        *(_schema(name, schema) for name, schema in document["components"]["schemas"].items()),
    ]
    return "\n".join(parts)


def _contents(operations: list[tuple[str, str, dict[str, Any]]]) -> str:
    rows = (
        f"<tr><td>{link('#' + operation['operationId'], f'{method} {path}')}</td><td>{_role(operation)}</td>"
        f"<td>{escape(operation['summary'])}</td></tr>"
        for method, path, operation in operations
    )
    return f"<table><tr><th>route</th><th>role</th><th></th></tr>\n{''.join(rows)}</table>"


def _operation(method: str, path: str, operation: dict[str, Any]) -> str:
    parts = [
        f'<section id="{escape(operation["operationId"])}"><h2>{code(f"{method} {path}")} {_role(operation)}</h2>',
        _prose(operation["description"]),
        *_parameters(operation.get("parameters", [])),
        *_body(operation.get("requestBody")),
        *_answers(operation["responses"]),
        "</section>",
    ]
    return "\n".join(parts)


def _role(operation: dict[str, Any]) -> str:
    role = operation.get(ROLE)
    return f'<span class="role">{escape(role)}</span>' if role else ""


def _prose(text: str) -> str:
    """Return paragraphs, with text in back quotes as code."""
    marked = re.sub(r"(`+)([^`]+)\1", r"<code>\2</code>", escape(text))
    return "".join(f"<p>{paragraph}</p>" for paragraph in marked.split("\n\n"))


def _parameters(parameters: list[dict[str, Any]]) -> Iterator[str]:
    if parameters:
        rows = (
            f"<tr><td>{code(p['name'])}</td><td>{escape(p['in'])}{', required' if p.get('required') else ''}</td>"
            f"<td>{escape(p.get('description', ''))}</td><td>{_folded('schema', p['schema'])}</td></tr>"
            for p in parameters
        )
        yield f"<table><tr><th>parameter</th><th>in</th><th></th><th></th></tr>\n{''.join(rows)}</table>"


def _body(body: dict[str, Any] | None) -> Iterator[str]:
    if body:
        yield f"<p>Body{'' if body.get('required') else ' (optional)'}:</p>"
        for kind, content in body["content"].items():
            yield _linked_schema(kind, content)
            for name, example in content["examples"].items():
                yield _folded(name, example["value"])


def _answers(answers: dict[str, Any]) -> Iterator[str]:
    rows = (
        f"<tr><td>{code(status)}</td><td>{escape(answer['description'])}</td><td>{_content(answer)}</td></tr>"
        for status, answer in sorted(answers.items())
    )
    yield f"<table><tr><th>answer</th><th></th><th></th></tr>\n{''.join(rows)}</table>"


def _content(answer: dict[str, Any]) -> str:
    return "".join(_linked_schema(kind, content) for kind, content in answer.get("content", {}).items())


def _linked_schema(kind: str, content: dict[str, Any]) -> str:
    schema = content.get("itemSchema") or content["schema"]
    name = str(schema.get("$ref", "")).rpartition("/")[2]
    return f"{escape(kind)}: {link('#schema-' + name, name)}" if name else _folded(kind, schema)


def _schema(name: str, schema: dict[str, Any]) -> str:
    return f'<section id="schema-{escape(name)}">{_folded(name, schema)}</section>'


def _folded(summary: str, value: Any) -> str:
    """Return JSON that unfolds by a click, without a script; references to schemas lead to them."""
    text = REFERENCE.sub(r'<a href="#schema-\1">\1</a>', escape(json.dumps(value, indent=2, ensure_ascii=False)))
    return f"<details><summary>{escape(summary)}</summary><pre>{text}</pre></details>"
