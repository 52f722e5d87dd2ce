"""Every acting route and every identity, as the OpenAPI document names them, against the HTTP server."""

from __future__ import annotations

import asyncio
import json
import os
import threading
import time
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import httpx
import pytest
from fastapi import APIRouter, FastAPI

from regraft import run_directory
from regraft.bus_schema.model.description import ParameterDescription, ServiceDescription
from regraft.dashboard_api.http import peers
from regraft.dashboard_api.http.authentication import Callers, user_name
from regraft.dashboard_api.http.authorization import Authorization
from regraft.dashboard_api.http.document import ROLE
from regraft.dashboard_api.http.roles import READING_METHODS, ROLES
from regraft.security.tokens import Role, Tokens
from tests.gateway.clients import NOBODY, Asked, ask_as, send_and_leave
from tests.gateway.conftest import Running
from tests.gateway.http.test_openapi import operations

AS_ROOT = pytest.mark.skipif(os.geteuid() != 0, reason="only root can become another user")
OWN = user_name(os.geteuid())
SLOWER = {"change": "set_parameters", "component": "navigator", "parameters": {"max_velocity": 0.1}}
SWAP = {"change": "swap", "component": "navigator", "class": "elsewhere:Navigator"}
STRUCTURE: list[dict[str, Any]] = [
    SWAP,
    {"change": "move", "component": "navigator", "host": "second"},
    {"change": "remove", "component": "navigator"},
    {"change": "add", "component": "second", "spec": {"class": "elsewhere:Second"}},
]


@pytest.fixture
def tokens(running: Running) -> Tokens:
    """Return the tokens of the running gateway."""
    assert running.site.keys.system == "site"
    return Tokens(run_directory.folder("site"))


def bearer(token: str, scheme: str = "Bearer") -> dict[str, str]:
    return {"Authorization": f"{scheme} {token}"}


@dataclass
class Act:
    """A request that acts, and the role it needs."""

    method: str
    path: str
    body: Any
    role: Role

    def send(self, http: httpx.Client, headers: dict[str, str]) -> httpx.Response:
        """Send it."""
        content = None if self.body is None else json.dumps(self.body)
        return http.request(
            self.method, self.path, content=content, headers={"Content-Type": "application/json", **headers}
        )


def acts(running: Running) -> Iterator[Act]:
    """Yield a request for every acting route of the document, and one more for each change that needs more."""
    document = running.http.get("/openapi.json").json()
    for path, method, operation in operations(document):
        if method == "get" or ROLE not in operation:
            continue
        role = Role(operation[ROLE])
        content = operation.get("requestBody", {}).get("content", {}).get("application/json", {})
        body = next((example["value"] for example in content.get("examples", {}).values()), None)
        plain = path.removeprefix("/api/v1").replace("{id}", "1").replace("{name}", "navigator")
        if plain == "/adaptations":
            body = {"changes": [SLOWER]}
        yield Act(method.upper(), plain, body, role)
        if any(each["name"] == "dry_run" for each in operation.get("parameters", ())):
            yield Act(method.upper(), f"{plain}?dry_run=true", body, role)
        if plain == "/adaptations":
            for change in STRUCTURE:
                yield Act("POST", plain, {"changes": [SLOWER, change]}, Role.ADMINISTER)
                yield Act("POST", f"{plain}?dry_run=true", {"changes": [change]}, Role.ADMINISTER)


def identities(tokens: Tokens) -> dict[str, tuple[dict[str, str], Role | int]]:
    """Return, for every identity that a header gives, the header, and its role or the status that it always gets."""
    operate, _ = tokens.create(Role.OPERATE, 3600.0, "page")
    administer, _ = tokens.create(Role.ADMINISTER, 3600.0, "desk")
    revoked, _ = tokens.create(Role.ADMINISTER, 3600.0, "revoked")
    tokens.revoke("revoked")
    expired, kept = tokens.create(Role.ADMINISTER, 3600.0, "expired")
    text = json.loads(tokens.path.read_text())
    text["tokens"][-1]["expires"] = time.time() - 1.0
    tokens.path.write_text(json.dumps(text))
    assert kept.name == text["tokens"][-1]["name"]
    return {
        "the own user": ({}, Role.ADMINISTER),
        "a token to operate": (bearer(operate), Role.OPERATE),
        "a token to administer": (bearer(administer), Role.ADMINISTER),
        "a lower-case scheme": (bearer(administer, "bearer"), Role.ADMINISTER),
        "a revoked token": (bearer(revoked), 401),
        "an expired token": (bearer(expired), 401),
        "a wrong token": (bearer(administer[:-1] + "!"), 401),
        "a hash for a token": (bearer(kept.digest), 401),
        "no token": ({"Authorization": "Bearer"}, 401),
        "another scheme": (bearer(administer, "Basic"), 401),
        "no scheme": ({"Authorization": administer}, 401),
    }


def is_problem(response: httpx.Response, slug: str) -> bool:
    problem = response.json()
    return bool(
        response.headers["content-type"] == "application/problem+json"
        and problem["type"] == f"urn:regraft:problem:{slug}"
        and "regraft token create" in problem["detail"]
    )


def test_every_acting_route_is_open_to_the_right_identities_alone(running: Running, tokens: Tokens) -> None:
    known = identities(tokens)
    # Some of the routes ask services that nobody offers here. The manager is waited for: it has no request left then.
    running.site.set_parameters("gateway", {"answer_within": 0.5})
    tried = 0
    for act in acts(running):
        for who, (headers, role) in known.items():
            before = len(running.manager.requests)
            response = act.send(running.http, headers)
            told = f"{act.method} {act.path} by {who}: {response.status_code} {response.text[:300]}"
            tried += 1
            if isinstance(role, Role) and role.includes(act.role):
                assert response.status_code not in (401, 403), told
                continue
            assert len(running.manager.requests) == before, told
            if role == 401:
                assert response.status_code == 401, told
                assert is_problem(response, "unauthenticated"), told
                assert response.headers["www-authenticate"].startswith("Bearer "), told
            else:
                assert response.status_code == 403, told
                assert is_problem(response, "forbidden"), told
                assert f"--role {act.role.value}" in response.json()["detail"], told
    assert tried >= 25 * len(known)


@AS_ROOT
def test_another_user_acts_nowhere_and_reads_everywhere(running: Running, tokens: Tokens) -> None:
    token, _ = tokens.create(Role.ADMINISTER, 3600.0)
    asked = list(acts(running))
    as_json = {"Content-Type": "application/json"}
    plain = [(a.method, f"/api/v1{a.path}", as_json, None if a.body is None else json.dumps(a.body)) for a in asked]
    for act, (status, _, body) in zip(asked, ask_as(NOBODY, running.url, plain), strict=True):
        assert status == 403, f"{act.method} {act.path}: {status} {body[:300]}"
        assert "uid 65534" in json.loads(body)["detail"]
    assert running.manager.requests == []
    reading: list[Asked] = [
        ("GET", f"/api/v1{path}", {}, None) for path in ("/system", "/architecture", "/adaptations", "/mission")
    ]
    assert [status for status, _, _ in ask_as(NOBODY, running.url, reading)] == [200] * 4
    with_token = [("POST", "/api/v1/adaptations", as_json | bearer(token), json.dumps({"changes": [SLOWER]}))]
    assert ask_as(NOBODY, running.url, with_token)[0][0] == 200


@AS_ROOT
def test_root_acts_where_another_user_runs_the_gateway(running: Running, monkeypatch: pytest.MonkeyPatch) -> None:
    body = json.dumps({"changes": [SLOWER]})
    ask = [("POST", "/api/v1/adaptations", {"Content-Type": "application/json"}, body)]
    monkeypatch.setattr(_callers(running), "_own", 4711)
    assert ask_as(None, running.url, ask)[0][0] == 200
    assert running.manager.requests[-1].actor == "uid 0 root"
    assert ask_as(4711, running.url, ask)[0][0] == 200
    assert running.manager.requests[-1].actor == "uid 4711"
    assert ask_as(4712, running.url, ask)[0][0] == 403


@AS_ROOT
def test_another_user_who_hangs_up_at_once_is_not_taken_for_root(running: Running) -> None:
    pending = running.post("/adaptations", {"changes": [SLOWER]}, headers={"Prefer": "respond-async"})
    assert pending.json()["outcome"] == "pending"
    for _ in range(20):
        # A route that acts without waiting for a body.
        send_and_leave(running.url, b"DELETE /api/v1/adaptations/1 HTTP/1.1\r\nHost: localhost\r\n\r\n")
    assert running.http.get("/adaptations/1").json()["outcome"] == "pending"


@AS_ROOT
@pytest.mark.parametrize("name", ["X-Forwarded-For", "Forwarded", "X-Real-IP"])
def test_another_user_cannot_claim_the_connection_of_somebody_else(shared: Running, name: str) -> None:
    with shared.connect() as http, http.stream("GET", "/events") as stream:
        host, port = stream.extensions["network_stream"].get_extra_info("client_addr")
        claims = (f"{host}:{port}", host)
        ask = [
            ("POST", "/api/v1/adaptations", {"Content-Type": "application/json", name: claim}, '{"changes": []}')
            for claim in claims
        ]
        assert [status for status, _, _ in ask_as(NOBODY, shared.url, ask)] == [403] * len(claims)


def test_where_the_kernel_cannot_say_a_token_is_needed(
    running: Running, tokens: Tokens, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(_callers(running), "_user", lambda scope: peers.user_of(scope, lambda *ends: None))
    for act in acts(running):
        refused = act.send(running.http, {})
        assert refused.status_code == 401, f"{act.method} {act.path}"
        assert refused.headers["www-authenticate"] == 'Bearer realm="regraft"'
        assert is_problem(refused, "unauthenticated")
    assert running.manager.requests == []
    token, _ = tokens.create(Role.OPERATE, 60.0)
    assert running.post("/adaptations", {"changes": [SLOWER]}, headers=bearer(token)).status_code == 200
    assert running.http.get("/system").status_code == 200


def test_a_token_is_honoured_and_revoked_at_once(running: Running, tokens: Tokens) -> None:
    for number in range(5):
        token, made = tokens.create(Role.OPERATE, 60.0, f"page-{number}")
        assert running.post("/adaptations", {"changes": [SLOWER]}, headers=bearer(token)).status_code == 200
        tokens.revoke(made.name)
        assert running.post("/adaptations", {"changes": [SLOWER]}, headers=bearer(token)).status_code == 401


def test_a_damaged_file_of_tokens_admits_nobody_by_token(running: Running, tokens: Tokens) -> None:
    token, _ = tokens.create(Role.ADMINISTER, 60.0)
    whole = tokens.path.read_text()
    for text in (whole[:-20], whole.replace("administer", "own"), "[]", ""):
        tokens.path.write_text(text)
        refused = running.post("/adaptations", {"changes": [SLOWER]}, headers=bearer(token))
        assert refused.status_code == 503
        assert "tokens.json" in refused.json()["detail"]
        assert running.manager.requests == []
    tokens.path.write_text(whole)
    assert running.post("/adaptations", {"changes": [SLOWER]}, headers=bearer(token)).status_code == 200


def test_the_journal_has_what_is_proven_before_the_name_that_is_given(running: Running, tokens: Tokens) -> None:
    token, _ = tokens.create(Role.OPERATE, 60.0, "page")
    for headers in ({}, bearer(token), {"X-Regraft-Actor": "uid 0 root"}, {"X-Regraft-Actor": "a\tb", **bearer(token)}):
        running.post("/adaptations", {"changes": [SLOWER]}, headers=headers)
    assert [r.actor for r in running.manager.requests] == [OWN, "token page", f"{OWN}: uid 0 root", "token page: ab"]


def test_what_names_a_file_or_configures_a_planner_or_the_mission_is_administered(
    running: Running, tokens: Tokens
) -> None:
    token, _ = tokens.create(Role.OPERATE, 60.0)
    architecture = running.manager.current
    navigator = architecture.components["navigator"]
    assert navigator.description
    more = (ParameterDescription("log", "", {}, unit="path"), ParameterDescription("mission", "", {}))
    offers = {"planner": "planners/bandits/propose", "executor": "mission/command"}
    described = {
        name: replace(
            navigator,
            name=name,
            description=replace(
                navigator.description,
                parameters=(*navigator.description.parameters, *more),
                services=(ServiceDescription(offers[name], "service", "", ""),) if name in offers else (),
            ),
            services={offers[name]: "renamed"} if name in offers else {},
        )
        for name in ("navigator", *offers)
    }
    described["stranger"] = replace(navigator, name="stranger", description=None)
    running.manager.revisions = {1: replace(architecture, components={**architecture.components, **described})}
    expected = {
        ("navigator", "max_velocity"): False,
        ("navigator", "log"): True,
        ("navigator", "mission"): False,
        ("navigator", "record"): True,
        ("planner", "max_velocity"): True,
        ("executor", "max_velocity"): False,
        ("executor", "mission"): True,
        ("executor", "main"): True,
        ("stranger", "max_velocity"): True,
        ("nobody", "max_velocity"): True,
    }
    for (component, parameter), needs_more in expected.items():
        change = {"change": "set_parameters", "component": component, "parameters": {parameter: 0.1}}
        long = running.post("/adaptations", {"changes": [change]}, headers=bearer(token))
        short = running.http.patch(f"/components/{component}/parameters", json={parameter: 0.1}, headers=bearer(token))
        for response in (long, short):
            assert (response.status_code == 403) is needs_more, (component, parameter, response.text)
            assert not needs_more or is_problem(response, "forbidden")
        assert running.post("/adaptations", {"changes": [change]}).status_code != 403


def test_a_mode_lets_nobody_set_what_it_brings(running: Running, tokens: Tokens) -> None:
    token, _ = tokens.create(Role.OPERATE, 60.0)
    present = running.manager.current.components["navigator"].cls
    modes: dict[str, Any] = {
        "more": [{"change": "add", "component": "second", "spec": {"class": "elsewhere:Second"}}],
        "other": [SWAP],
        "same": [{**SWAP, "class": present}, {"change": "swap", "component": "drive", "parameters": {}}],
        "faulty": [{"change": "swap"}],
    }
    running.manager.revisions = {1: replace(running.manager.current, modes=modes)}
    of_second = {**SLOWER, "component": "second"}
    expected = [
        ([{"change": "mode", "mode": "more"}, of_second], True),
        ([SLOWER, {"change": "mode", "mode": "other"}], True),
        ([{"change": "mode", "mode": "same"}, {"change": "mode", "mode": "other"}, SLOWER], True),
        ([{"change": "mode", "mode": "more"}, SLOWER], False),
        ([{"change": "mode", "mode": "same"}, SLOWER], False),
        ([{"change": "mode", "mode": "faulty"}, SLOWER], False),
        ([{"change": "mode", "mode": "missing"}, SLOWER], False),
        ([{"change": "mode", "mode": "other"}], False),
    ]
    for changes, needs_more in expected:
        running.manager.requests.clear()
        answer = running.post("/adaptations", {"changes": changes}, headers=bearer(token))
        assert (answer.status_code == 403) is needs_more, (changes, answer.text)
        assert len(running.manager.requests) == (0 if needs_more else 1)


def test_every_acting_route_declares_a_role_and_every_role_a_route(shared: Running) -> None:
    document = shared.http.get("/openapi.json").json()
    found = {
        (method.upper(), path.removeprefix("/api/v1"))
        for path, method, _ in operations(document)
        if method.upper() not in READING_METHODS
    }
    assert found == set(ROLES)


def test_a_route_without_a_declared_role_is_refused(tmp_path: Path) -> None:
    app, reached = FastAPI(), threading.Event()
    router = APIRouter()
    router.add_api_route("/api/v1/format-the-disk", reached.set, methods=["POST"])
    app.include_router(router)
    app.add_middleware(Authorization, callers=Callers(Tokens(tmp_path)), prefix="/api/v1", document=app.openapi)
    with httpx.Client(transport=_InProcess(app), base_url="http://localhost") as http:
        refused = http.post("/api/v1/format-the-disk")
        assert refused.status_code == 403
        assert "no role is declared" in refused.json()["detail"]
        assert http.post("/api/v1/elsewhere").status_code == 404
    assert not reached.is_set()


def test_a_websocket_without_a_declared_role_is_closed_before_it_is_accepted(tmp_path: Path) -> None:
    sent: list[Any] = []
    reached: list[Any] = []

    async def app(scope: Any, receive: Any, send: Any) -> None:
        reached.append(scope)

    async def receive() -> Any:
        return {"type": "websocket.connect"}

    async def send(message: Any) -> None:
        sent.append(message["type"])

    gate = Authorization(app, Callers(Tokens(tmp_path)), "/api/v1", lambda: {"paths": {}})
    asyncio.run(gate({"type": "websocket", "path": "/api/v1/drive", "headers": []}, receive, send))
    assert (reached, sent) == ([], ["websocket.close"])


class _InProcess(httpx.BaseTransport):
    """Asks an application without a server."""

    def __init__(self, app: FastAPI) -> None:
        self._app = app

    def handle_request(self, request: httpx.Request) -> httpx.Response:
        async def ask() -> httpx.Response:
            transport = httpx.ASGITransport(self._app)
            async with httpx.AsyncClient(transport=transport) as client:
                found = await client.request(request.method, request.url)
                return httpx.Response(found.status_code, headers=found.headers, content=found.content)

        return asyncio.run(ask())


def _callers(running: Running) -> Any:
    """Return what identifies the callers of the running gateway."""
    gateway: Any = running.site.runtimes["gateway"].component
    return gateway._callers
