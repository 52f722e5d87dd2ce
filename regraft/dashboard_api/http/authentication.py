"""Proves who asks: by a token, or by the user at the other end of the connection."""

from __future__ import annotations

import os
import pwd
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from starlette.datastructures import Headers
from starlette.types import Scope

from regraft.dashboard_api.http.peers import user_of
from regraft.dashboard_api.http.problems import FORBIDDEN, UNAUTHENTICATED, Problem, unavailable
from regraft.security.tokens import BadTokens, Role, Tokens

CALLER: Final = "regraft.caller"
"""Where a request's scope has its proven caller."""
REALM: Final = 'Bearer realm="regraft"'
MAX_NAME_LENGTH: Final = 64
OVERFLOW: Final = Path("/proc/sys/kernel/overflowuid")


@dataclass(frozen=True, slots=True)
class Caller:
    """The one who asks: ``proven`` in words, and the role that this gives; None may only read."""

    proven: str
    role: Role | None
    by_token: bool = False

    def require(self, role: Role, what: str) -> None:
        """Raise Problem (403) if the caller's role does not include ``role``, which ``what`` needs."""
        if self.role is not None and self.role.includes(role):
            return
        has = f"has the role {self.role.value}" if self.role else "may read, but not act"
        headers = {"WWW-Authenticate": f'{REALM}, error="insufficient_scope"'} if self.by_token else {}
        raise Problem(
            FORBIDDEN, f"{self.proven} {has}: {what} needs the role {role.value}; {_way_in(role)}", headers=headers
        )


class Callers:
    """Finds out who asks, for each request again: ports are used again, and tokens are revoked."""

    def __init__(self, tokens: Tokens, user: Callable[[Scope], int | None] = user_of) -> None:
        """Admit by ``tokens``, and by the user that the kernel reports."""
        self._tokens = tokens
        self._user = user
        self._own = os.geteuid()

    def identify(self, scope: Scope, role: Role) -> Caller:
        """Return who asks; raises Problem (401), which states how to get ``role``, if nothing proves it.

        A token that is given is decided on alone: one that is wrong is never made good by the user.
        """
        given = Headers(scope=scope).getlist("authorization")
        if given:
            return self._by_token(given, role)
        uid = self._user(scope)
        if uid is None:
            raise _unauthenticated(f"nothing proves who asks; {_way_in(role)}")
        return Caller(user_name(uid), Role.ADMINISTER if is_own(uid, self._own) else None)

    def _by_token(self, given: list[str], role: Role) -> Caller:
        scheme, _, token = given[0].strip().partition(" ")
        if len(given) > 1 or scheme.lower() != "bearer" or not token.strip():
            raise _unauthenticated(f"the header Authorization must be given once, as 'Bearer TOKEN'; {_way_in(role)}")
        try:
            found = self._tokens.find(token.strip())
        except BadTokens as error:
            raise unavailable(str(error)) from None
        if found is None:
            why = f"the token is unknown, revoked or expired; {_way_in(role)}"
            raise _unauthenticated(why, "invalid_token")
        return Caller(f"token {found.name}", found.role, by_token=True)


def is_own(uid: int, own: int) -> bool:
    """Return whether a user may act: root, or the one that runs the gateway.

    The overflow uid is that of every user that a container cannot name: it is nobody's own.
    """
    return uid == 0 or (uid == own and uid != _overflow())


def user_name(uid: int) -> str:
    """Return a user for the journal: ``uid 1000 ana``."""
    try:
        name = pwd.getpwuid(uid).pw_name
    except KeyError:
        return f"uid {uid}"
    return f"uid {uid} {''.join(c for c in name if c.isprintable())[:MAX_NAME_LENGTH]}"


def _overflow() -> int:
    try:
        return int(OVERFLOW.read_text())
    except (OSError, ValueError):
        return 65534


def _way_in(role: Role) -> str:
    return (
        f"ask as {user_name(os.geteuid())}, who runs the gateway, or with 'Authorization: Bearer TOKEN' "
        f"and a token of 'regraft token create --role {role.value} --for 8h'"
    )


def _unauthenticated(detail: str, error: str = "") -> Problem:
    challenge = f'{REALM}, error="{error}"' if error else REALM
    return Problem(UNAUTHENTICATED, detail, headers={"WWW-Authenticate": challenge})
