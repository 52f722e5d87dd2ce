"""The pages for people: what is there, at ``/`` and where the API begins, and the API's description."""

from __future__ import annotations

from collections.abc import Callable
from typing import Annotated, Any, Final

from fastapi import APIRouter, Header
from starlette.responses import JSONResponse, Response

from regraft.dashboard_api.routes.html import code, html_page, link
from regraft.dashboard_api.routes.openapi_page import openapi_page

LINKS: Final = {
    "/system": "the system in one answer: components by state, hosts, clock, problems",
    "/components": "all components",
    "/topics": "all topics",
    "/hosts": "all hosts and their processes",
    "/architecture": "what should be",
    "/adaptations": "the journal of adaptations",
    "/mission": "the mission: its tree and its blackboard",
    "/planners": "the planners",
    "/events": "events as they happen (server-sent)",
    "/openapi.html": "every route, for people",
    "/openapi.json": "every route, for programs (OpenAPI)",
}


def routes(system: str, document: Callable[[], dict[str, Any]], prefix: str) -> APIRouter:
    """Return the routes, which are not part of the document that they show."""
    router = APIRouter(include_in_schema=False)

    def show_what_is_there(accept: Annotated[str, Header()] = "*/*") -> Response:
        if _prefers_json(accept):
            return JSONResponse({"system": system, "links": {prefix + path: text for path, text in LINKS.items()}})
        return html_page(f"{system}: Regraft", _landing(system, prefix))

    def show_document() -> Response:
        return html_page(f"{system}: routes", openapi_page(document(), prefix))

    router.add_api_route("/", show_what_is_there)
    router.add_api_route(prefix, show_what_is_there)
    router.add_api_route(f"{prefix}/openapi.html", show_document)
    return router


def _prefers_json(accept: str) -> bool:
    """Return whether a client would rather have JSON than HTML; one that takes anything gets HTML."""
    weights = {"application/json": 0.0, "text/html": 0.0, "*/*": 0.0}
    for part in accept.lower().split(","):
        kind, *parameters = (word.strip() for word in part.split(";"))
        quality = next((word[2:] for word in parameters if word.startswith("q=")), "1")
        if kind in weights:
            weights[kind] = _number(quality)
    html = weights["text/html"] or weights["*/*"]
    return weights["application/json"] > html or (weights["application/json"] > 0.0 and not weights["text/html"])


def _number(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        return 0.0


def _landing(system: str, prefix: str) -> str:
    rows = "\n".join(
        f"<tr><td>{link(prefix + path, prefix + path)}</td><td>{text}</td></tr>" for path, text in LINKS.items()
    )
    return (
        f"<h1>{code(system)}</h1>\n<p>This is the gateway of a robot system that Regraft runs.</p>\n"
        f"<table>\n{rows}\n</table>\n"
        "<p>Reading is open to every user of this machine. Acting is for the user that runs the gateway, for root, and "
        f"for whoever has a token of {code('regraft token create')}.</p>"
    )
