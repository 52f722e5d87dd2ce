"""Access tokens for a system's gateway, in ``tokens.json`` of the system's folder: hashes alone, never a token.

A token is 256 random bits, so that its SHA-256 cannot be turned back, and needs no salt.
"""

from __future__ import annotations

import contextlib
import fcntl
import hashlib
import json
import os
import re
import secrets
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from enum import Enum
from pathlib import Path
from typing import Annotated, Any, Final

from regraft.bus_schema.annotations import Bounds, Text
from regraft.bus_schema.encoding.records import record_shape
from regraft.bus_schema.errors import BadMessage
from regraft.bus_schema.suggestions import instead_of
from regraft.run_directory import NoRoom

FILE: Final = "tokens.json"
PREFIX: Final = "regraft_"
"""The beginning of every token, by which one that leaked can be found."""
NAME: Final = re.compile(r"[A-Za-z0-9][A-Za-z0-9._-]{0,63}")
DIGEST: Final = re.compile(r"[0-9a-f]{64}")
SHORTEST: Final = 1.0
LONGEST: Final = 366 * 86_400.0
MAX_FILE_SIZE: Final = 4 * 1024 * 1024
"""Bytes of the file: some 20,000 tokens."""
Stamp = Annotated[float, Bounds(0.0, 1e11)]
"""Seconds since 1970, as a date that a calendar has."""


class BadTokens(Exception):
    """The file of tokens cannot be read or is damaged: nobody is admitted by it. The text names file and field."""


class BadToken(Exception):
    """A token cannot be made or revoked as it was asked for; the text states why."""


class Role(Enum):
    """The permission of a caller. ``ADMINISTER`` includes ``OPERATE``."""

    OPERATE = "operate"
    ADMINISTER = "administer"

    def includes(self, other: Role) -> bool:
        """Return whether this role may do what ``other`` may."""
        return self is Role.ADMINISTER or other is Role.OPERATE


@dataclass(frozen=True, slots=True)
class Token:
    """A token as it is kept: ``digest`` is its SHA-256; times are seconds since 1970."""

    name: Annotated[str, Text(64)]
    role: Role
    created: Stamp
    expires: Stamp
    digest: Annotated[str, Text(64)]

    def __post_init__(self) -> None:
        if not NAME.fullmatch(self.name):
            raise BadMessage(f"is {self.name!r}, must be letters, digits, '.', '_' and '-', at most 64", ("name",))
        if not DIGEST.fullmatch(self.digest):
            raise BadMessage("is no SHA-256 in hexadecimal digits", ("digest",))

    @property
    def expired(self) -> bool:
        """Whether its time is over."""
        return time.time() >= self.expires


class Tokens:
    """The tokens of one system; the file is read again whenever it has changed."""

    def __init__(self, folder: Path) -> None:
        self.path = folder / FILE
        self._read: tuple[tuple[int, ...], tuple[Token, ...]] | None = None

    def create(self, role: Role, seconds: float, name: str = "") -> tuple[str, Token]:
        """Make a token that is valid for so many seconds; returns it, for the only time, and what is kept of it.

        Raises:
            BadToken: the name is taken or cannot be one, or the time is not between a second and 366 days.
            BadTokens: the file is damaged.
            NoRoom: the file cannot be written.
        """
        if not SHORTEST <= seconds <= LONGEST:
            raise BadToken(f"a token cannot be valid for {seconds:g} s: must be 1 s to {LONGEST / 86_400:g} d")
        if name and not NAME.fullmatch(name):
            raise BadToken(f"{name!r} cannot name a token: must be letters, digits, '.', '_' and '-', at most 64")
        token = PREFIX + secrets.token_urlsafe(32)
        now = time.time()
        made = Token(name or f"{role.value}-{secrets.token_hex(3)}", role, now, now + seconds, _digest(token))

        def added(tokens: Sequence[Token]) -> tuple[Token, ...]:
            valid = tuple(other for other in tokens if not other.expired)
            if any(other.name == made.name for other in valid):
                raise BadToken(f"there is a token {made.name!r} already: revoke it first, or choose another --name")
            return (*valid, made)

        self._change(added)
        return token, made

    def revoke(self, name: str) -> Token:
        """Forget a token; raises BadToken without one of that name, BadTokens, NoRoom."""
        found: list[Token] = []

        def without(tokens: Sequence[Token]) -> tuple[Token, ...]:
            found.extend(token for token in tokens if token.name == name)
            if not found:
                hint = instead_of(name, [token.name for token in tokens])
                raise BadToken(f"there is no token {name!r}; {hint}")
            return tuple(token for token in tokens if token.name != name)

        self._change(without)
        return found[0]

    def all(self) -> tuple[Token, ...]:
        """Return all tokens, those included that expired since the last one was made; raises BadTokens."""
        try:
            with self.path.open("rb") as file:
                status = os.fstat(file.fileno())
                seen = (status.st_ino, status.st_mtime_ns, status.st_ctime_ns, status.st_size)
                read = self._read
                if read is None or read[0] != seen:
                    read = seen, _parsed(self.path, status.st_mode, file.read(MAX_FILE_SIZE + 1))
                    self._read = read
        except FileNotFoundError:
            return ()
        except OSError as error:
            raise BadTokens(f"cannot read {self.path}: {error.strerror}. No token is admitted") from None
        return read[1]

    def find(self, token: str) -> Token | None:
        """Return what is kept of a token, None if it is unknown, revoked or expired; raises BadTokens."""
        digest = _digest(token)
        return next((kept for kept in self.all() if kept.digest == digest and not kept.expired), None)

    def _change(self, change: Callable[[Sequence[Token]], tuple[Token, ...]]) -> None:
        try:
            self.path.parent.mkdir(parents=True, exist_ok=True, mode=0o700)
            with _alone(self.path.parent):
                _write(self.path, change(self.all()))
        except OSError as error:
            raise NoRoom(f"cannot write {self.path}: {error.strerror}; REGRAFT_HOME names another place") from None


def _digest(token: str) -> str:
    return hashlib.sha256(token.encode(errors="replace")).hexdigest()


@contextlib.contextmanager
def _alone(folder: Path) -> Iterator[None]:
    """Keep other commands from changing the file meanwhile: one change would be lost."""
    descriptor = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX)
        yield
    finally:
        os.close(descriptor)


def _write(path: Path, tokens: Sequence[Token]) -> None:
    fresh = path.with_suffix(".new")
    fresh.unlink(missing_ok=True)
    try:
        descriptor = os.open(fresh, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600)
        with os.fdopen(descriptor, "w") as file:
            if os.geteuid() == 0:
                # The gateway may run as the folder's owner, and has to read it.
                owner = path.parent.stat()
                os.fchown(file.fileno(), owner.st_uid, owner.st_gid)
            json.dump({"tokens": [record_shape(Token).pack(token) for token in tokens]}, file, indent=1)
            file.write("\n")
            file.flush()
            os.fsync(file.fileno())
        fresh.replace(path)
    except OSError:
        fresh.unlink(missing_ok=True)
        raise


def _parsed(path: Path, mode: int, text: bytes) -> tuple[Token, ...]:
    if mode & 0o077:
        raise BadTokens(f"{path}: is open to other users (mode {mode & 0o777:o}). No token is admitted: chmod 600 it")
    if len(text) > MAX_FILE_SIZE:
        raise BadTokens(f"{path}: is larger than {MAX_FILE_SIZE // 1024} KiB. No token is admitted: remove the file")
    try:
        plain: Any = json.loads(text)
        listed = plain["tokens"] if isinstance(plain, dict) and plain.keys() == {"tokens"} else None
        if not isinstance(listed, list):
            raise BadMessage("must be an object with a list 'tokens' alone")
        return tuple(_token(index, entry) for index, entry in enumerate(listed))
    except BadMessage as error:
        why = str(error)
    except (ValueError, RecursionError) as error:
        why = f"is not JSON: {error}"
    raise BadTokens(f"{path}: {why}. No token is admitted: remove the file, and make new tokens")


def _token(index: int, plain: Any) -> Token:
    try:
        token: Token = record_shape(Token).unpack(plain)
    except BadMessage as error:
        raise error.inside(str(index)).inside("tokens") from None
    return token
