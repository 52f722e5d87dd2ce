"""Asks a system something before this process has a session: its zygote must be forked before it opens one."""

from __future__ import annotations

import contextlib
import os
import signal

from regraft.bus.interface import Answer, BusError
from regraft.bus.zenoh_bus import open_bus
from regraft.bus.zenoh_config import Endpoints


def asked_by_a_child(endpoints: Endpoints, key: str, payload: bytes, timeout: float) -> Answer | None:
    """Return the first answer to a query, asked by a process of its own; None if nobody answers.

    Raises:
        BusError: the endpoint cannot be reached.
    """
    reader, writer = os.pipe()
    pid = os.fork()
    if pid == 0:
        code = 1
        try:
            os.close(reader)
            with os.fdopen(writer, "wb") as out:
                out.write(_asked(endpoints, key, payload, timeout))
            code = 0
        finally:
            os._exit(code)
    os.close(writer)
    try:
        with os.fdopen(reader, "rb") as answer:
            told = answer.read()
    except BaseException:
        with contextlib.suppress(ProcessLookupError):
            os.kill(pid, signal.SIGKILL)
        raise
    finally:
        os.waitpid(pid, 0)
    kind, told = told[:1], told[1:]
    if kind == b"-":
        raise BusError(told.decode())
    return Answer("", told, error=kind == b"!") if kind in (b"+", b"!") else None


def _asked(endpoints: Endpoints, key: str, payload: bytes, timeout: float) -> bytes:
    try:
        bus = open_bus(endpoints)
        answers = bus.query(key, payload, timeout)
        bus.close()
    except BusError as error:
        return b"-" + str(error).encode()
    if not answers:
        return b""
    return (b"!" if answers[0].error else b"+") + answers[0].payload
