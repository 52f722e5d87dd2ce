"""The headers that adapting routes share, and the caller."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Annotated, Any

from fastapi import Depends, Header, Query, Request

from regraft.bus_schema.messages.management.manager import UndoAdaptation
from regraft.bus_schema.model.adaptation import AdaptationRequest
from regraft.dashboard_api.http.authentication import CALLER, Caller
from regraft.dashboard_api.http.body import built
from regraft.dashboard_api.http.problems import FORBIDDEN, Problem, malformed, violation

MAX_ACTOR_LENGTH = 100
MAX_KEY_LENGTH = 200
ActorHeader = Annotated[
    str, Header(description="A name for the journal, which has it behind what is proven of the caller")
]
DryRun = Annotated[bool, Query(description="Return plan and resulting architecture, touch nothing")]
ENTITY_TAGS = r'^(\*|"[0-9]{1,18}(-[0-9a-z-]{1,64})?")$'
ENTITY_TAG = re.compile(r'"([0-9]{1,18})(-[0-9a-z-]{1,64})?"')
"""The ETag of an architecture: its revision alone decides."""


@dataclass(frozen=True, slots=True)
class AdaptationHeaders:
    """The caller, and its name for the journal; the revision it saw (None: any); the key of a repetition."""

    caller: Caller
    actor: str
    revision: int | None
    key: str
    dry_run: bool
    wait: bool

    def request(self, changes: tuple[Any, ...], *, revision: int | None = None, **fields: Any) -> AdaptationRequest:
        """Return the adaptation of a body under these headers; raises Problem where they do not fit together."""
        if None not in (revision, self.revision) and revision != self.revision:
            raise malformed(violation("revision", f"is {revision}, but If-Match says {self.revision}"))
        return built(
            AdaptationRequest,
            changes,
            actor=self.actor,
            revision=revision if self.revision is None else self.revision,
            key=self.key,
            dry_run=self.dry_run,
            wait=self.wait,
            **fields,
        )

    def undo(self, adaptation: str, fields: dict[str, Any]) -> UndoAdaptation:
        """Return the undo of an adaptation under these headers, with the other fields of a body; raises Problem."""
        return built(
            UndoAdaptation,
            adaptation,
            self.actor,
            dry_run=self.dry_run,
            revision=self.revision,
            key=self.key,
            wait=self.wait,
            **fields,
        )


def adaptation_headers(
    request: Request,
    dry_run: DryRun = False,
    if_match: Annotated[
        str,
        Header(
            description="The ETag of the architecture that the caller saw, of which the revision counts, or *",
            examples=['"12"'],
            json_schema_extra={"pattern": ENTITY_TAGS},
        ),
    ] = "*",
    idempotency_key: Annotated[
        str, Header(description="The same key and body are the same adaptation", max_length=MAX_KEY_LENGTH)
    ] = "",
    prefer: Annotated[str, Header(description="`respond-async` answers at once, with 202 and a Location")] = "",
    x_regraft_actor: ActorHeader = "",
) -> AdaptationHeaders:
    """Return the headers of a request, read; raises Problem."""
    preferences = {preference.strip().lower() for preference in prefer.split(",")}
    return AdaptationHeaders(
        caller(request),
        actor(request, x_regraft_actor),
        _revision(if_match),
        idempotency_key,
        dry_run,
        "respond-async" not in preferences,
    )


Asked = Annotated[AdaptationHeaders, Depends(adaptation_headers)]


def caller(request: Request) -> Caller:
    """Return who asks, as the gate has proven it; raises Problem where it has let nobody in."""
    proven = request.scope.get(CALLER)
    if not isinstance(proven, Caller):
        raise Problem(FORBIDDEN, "no role is declared for this route in regraft/dashboard_api/http/roles.py")
    return proven


def actor(request: Request, named: str) -> str:
    """Return who asks, for the journal: what is proven, then the name given, as in ``uid 1000 ana: page``."""
    text = named.encode("latin-1", "replace").decode(errors="replace")
    name = "".join(c for c in text if c.isprintable()).strip()[:MAX_ACTOR_LENGTH]
    return ": ".join(filter(None, (caller(request).proven, name)))


def _revision(if_match: str) -> int | None:
    if if_match.strip() == "*":
        return None
    tag = ENTITY_TAG.fullmatch(if_match.strip())
    if tag is None:
        wrong = f'is {if_match!r}, must be * or the ETag of /architecture, such as "12"'
        raise malformed(violation("If-Match", wrong))
    return int(tag[1])
