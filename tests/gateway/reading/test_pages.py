"""A person sees in a browser a page with what is there, and one with every route."""

from __future__ import annotations

import base64
import hashlib
import re
from html import escape
from html.parser import HTMLParser

import httpx
import pytest

from regraft.dashboard_api.routes.openapi_page import openapi_page
from tests.gateway.conftest import Running
from tests.gateway.http.test_openapi import operations
from tests.support.waiting import PATIENCE

PAGES = ("/", "/api/v1", "/api/v1/openapi.html")


class Page(HTMLParser):
    """The parts of a page."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.tags: list[str] = []
        self.links: list[str] = []
        self.ids: list[str] = []
        self.attributes: set[str] = set()
        self.open: list[str] = []
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append(tag)
        self.attributes |= {name for name, _ in attrs}
        self.links += [value for name, value in attrs if name in ("href", "src") and value]
        self.ids += [value for name, value in attrs if name == "id" and value]
        if tag != "meta":
            self.open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag


def get(
    running: Running, path: str, accept: str | None = "text/html,application/xhtml+xml,*/*;q=0.8"
) -> httpx.Response:
    headers = {b"Accept": accept.encode("latin-1")} if accept else {}
    return httpx.get(running.url.removesuffix("/api/v1") + path, headers=headers, timeout=PATIENCE, verify=False)


@pytest.mark.parametrize("path", PAGES)
def test_a_page_needs_no_other_host_and_runs_no_script(shared: Running, path: str) -> None:
    answer = get(shared, path)
    assert answer.status_code == 200
    assert answer.headers["content-type"] == "text/html; charset=utf-8"
    page = Page(answer.text)
    assert page.open == []
    assert not {"script", "link", "img", "iframe", "form", "base"} & set(page.tags)
    assert not any(name.startswith("on") or name == "style" for name in page.attributes)
    assert all(target.startswith(("/api/v1", "#")) for target in page.links)
    style = re.findall(r"<style>(.*?)</style>", answer.text, re.DOTALL)
    assert len(style) == 1
    digest = base64.b64encode(hashlib.sha256(style[0].encode()).digest()).decode()
    policy = answer.headers["content-security-policy"]
    assert policy.startswith("default-src 'none'; ")
    assert f"style-src 'sha256-{digest}'" in policy
    assert "unsafe" not in policy


@pytest.mark.parametrize("path", ["/", "/api/v1"])
def test_what_is_there_is_shown_and_every_link_leads_somewhere(shared: Running, path: str) -> None:
    answer = get(shared, path)
    assert ">site<" in answer.text
    links = set(Page(answer.text).links)
    assert {"/api/v1/system", "/api/v1/openapi.html", "/api/v1/openapi.json"} <= links
    for target in sorted(links):
        assert shared.http.head(shared.url.removesuffix("/api/v1") + target).status_code == 200, target


@pytest.mark.parametrize(
    ("accept", "kind"),
    [
        ("application/json", "application/json"),
        ("application/json, text/html;q=0.5", "application/json"),
        ("application/json, */*", "application/json"),
        ("text/html", "text/html"),
        ("application/json;q=0.4, text/html", "text/html"),
        ("*/*", "text/html"),
        (None, "text/html"),
        ("application/json;q=much", "text/html"),
        ("\u20ac,;;=,q=".encode().decode("latin-1"), "text/html"),
    ],
)
def test_a_program_gets_json_if_it_prefers_it(shared: Running, accept: str | None, kind: str) -> None:
    answer = get(shared, "/", accept)
    assert answer.status_code == 200
    assert answer.headers["content-type"].startswith(kind)
    if kind == "application/json":
        assert answer.json()["system"] == "site"
        assert "/api/v1/architecture" in answer.json()["links"]


def test_every_route_is_on_the_page_with_its_role_parameters_body_and_answers(shared: Running) -> None:
    document = shared.http.get("/openapi.json").json()
    text = get(shared, "/api/v1/openapi.html").text
    page = Page(text)
    sections = dict(re.findall(r'<section id="([^"]+)">(.*?)</section>', text, re.DOTALL))
    for path, method, operation in operations(document):
        shown = sections[operation["operationId"]]
        assert f"{method.upper()} {path}" in shown
        role = operation.get("x-regraft-role")
        assert re.findall(r'<span class="role">(\w+)</span>', shown) == ([role] if role else [])
        for parameter in operation.get("parameters", []):
            assert f"<code>{parameter['name']}</code>" in shown
        for status, answer in operation["responses"].items():
            assert f"<td><code>{status}</code></td><td>{escape(answer['description'])}</td>" in shown
        assert ("Body" in shown) is ("requestBody" in operation)
    assert {link[1:] for link in page.links if link.startswith("#")} <= set(page.ids)
    assert {f"schema-{name}" for name in document["components"]["schemas"]} <= set(page.ids)


def test_text_of_the_document_is_never_taken_for_html() -> None:
    evil = "<script>alert(1)</script>\"'&"
    operation = {
        "operationId": evil,
        "summary": evil,
        "description": evil,
        "x-regraft-role": evil,
        "parameters": [{"name": evil, "in": evil, "description": evil, "schema": {"default": evil}}],
        "requestBody": {"content": {evil: {"schema": {evil: evil}, "examples": {evil: {"value": evil}}}}},
        "responses": {evil: {"description": evil, "content": {evil: {"schema": {"$ref": evil}}}}},
    }
    document = {
        "info": {"title": evil, "description": evil},
        "paths": {evil: {"post": operation}},
        "components": {"schemas": {evil: {"description": evil}}},
    }
    assert "script" not in Page(openapi_page(document, "/api/v1")).tags
