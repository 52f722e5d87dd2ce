"""A faulty member of a system: bare Zenoh, no manners."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import zenoh

from regraft.bus.zenoh_config import config
from regraft.bus_schema.encoding import codec
from regraft.bus_schema.encoding.envelope import Envelope
from regraft.bus_schema.encoding.registry import type_of
from regraft.run_directory import RunInfo
from tests.support.waiting import PATIENCE


class Raw:
    """One session that puts and asks whatever it likes."""

    def __init__(self, info: RunInfo, *, lockstep: bool = False) -> None:
        self.session = zenoh.open(config(info.hub, lockstep=lockstep))

    def put(self, key: str, payload: bytes, encoding: str = "", attachment: bytes = b"") -> None:
        """Put bytes; an empty attachment is none."""
        self.session.put(
            key,
            payload,
            encoding=encoding or None,
            attachment=attachment or None,
            congestion_control=zenoh.CongestionControl.BLOCK,
        )

    def say(self, key: str, message: object, source: str = "", incarnation: int = 1, sequence: int = 1) -> None:
        """Put a well-formed message, in somebody's name where ``source`` is given."""
        attachment = b""
        if source:
            attachment = Envelope(source, incarnation, incarnation, sequence, time.time_ns()).to_bytes()
        self.put(key, codec.encode(message), type_of(type(message)).encoding, attachment)

    def ask(self, key: str, payload: bytes = b"", timeout: float = PATIENCE) -> list[tuple[bool, bytes]]:
        """Return the answers: whether each is an error, and its payload."""
        answers = []
        for reply in self.session.get(key, payload=payload, timeout=timeout):
            if reply.ok is not None:
                answers.append((False, reply.ok.payload.to_bytes()))
            elif reply.err is not None and reply.err.payload.to_bytes() != b"Timeout":
                answers.append((True, reply.err.payload.to_bytes()))
        return answers

    def token(self, key: str) -> Any:
        """Declare a liveliness token."""
        return self.session.liveliness().declare_token(key)

    def close(self) -> None:
        """Leave."""
        closing: Any = self.session
        closing.close()


@contextmanager
def stranger(info: RunInfo, *, lockstep: bool = False) -> Iterator[Raw]:
    """Be on the bus for a while."""
    raw = Raw(info, lockstep=lockstep)
    try:
        yield raw
    finally:
        raw.close()
