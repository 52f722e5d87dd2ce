"""The real bus: one Eclipse Zenoh session."""

from __future__ import annotations

import contextlib
import os
import re
import threading
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import zenoh

from regraft.bus.interface import Answer, BusError, Presence, Sample, Sink
from regraft.bus.zenoh_config import SHARED_MEMORY_FROM, Endpoints, admitted, config
from regraft.bus.zenoh_leftovers import remove_at_exit
from regraft.bus.zenoh_listening import await_data
from regraft.bus.zenoh_session import Declared, LastingSession
from regraft.bus.zenoh_shared import SharedMemory

SOURCE_PLACE = re.compile(r"\s+at /\S+\.rs:\d+\.?")
"""Where in Zenoh's own sources an error arose: of no use to a reader of the message."""

Direct = zenoh.handlers.Callback

_AT_ONCE: dict[str, Any] = {"consolidation": zenoh.ConsolidationMode.NONE}
"""An answer is passed on when it comes, not only when it is sure that no more come."""
FIRST_ANSWER: dict[str, Any] = {"target": zenoh.QueryTarget.BEST_MATCHING, **_AT_ONCE}
ALL_ANSWERS: dict[str, Any] = {"target": zenoh.QueryTarget.ALL, **_AT_ONCE}


def open_bus(endpoints: Endpoints, *, lockstep: bool = False) -> ZenohBus:
    """Open the process's session; raises BusError if the endpoints cannot be reached or listened on."""
    os.environ.setdefault("RUST_LOG", "off")
    remove_at_exit()

    def opened() -> zenoh.Session:
        with admitted(endpoints) as file:
            session = zenoh.open(config(endpoints, lockstep=lockstep, admitted=file))
        await_data(endpoints.listen)
        return session

    try:
        return ZenohBus(LastingSession(opened(), opened if endpoints.needs_hub else None), lockstep=lockstep)
    except zenoh.ZError as error:
        wanted = ", ".join(endpoints.listen or endpoints.connect)
        verb = "listen on" if endpoints.listen else "reach"
        raise BusError(f"cannot {verb} {wanted}: {_first_line(error)}") from None


def _first_line(error: Exception) -> str:
    line = (str(error).splitlines() or ["unknown error"])[0]
    return SOURCE_PLACE.sub("", line).strip(" []!")


@dataclass(slots=True)
class ZenohPublisher:
    """A key that one session writes, also after its link broke and was renewed."""

    key: str
    declared: Declared
    shared: SharedMemory

    def put(self, payload: bytes, attachment: bytes) -> None:
        inner = self.declared.inner
        if inner is None:
            return
        try:
            large = len(payload) >= SHARED_MEMORY_FROM
            inner.put(self.shared.place(payload) if large else payload, attachment=attachment)
        except zenoh.ZError as error:
            if inner is self.declared.inner and not self.declared.session.broken:
                raise BusError(f"cannot put at {self.key}: {_first_line(error)}") from None

    @property
    def matched(self) -> bool:
        inner = self.declared.inner
        if inner is None:
            return False
        try:
            return bool(inner.matching_status.matching)
        except zenoh.ZError:
            return False

    def close(self) -> None:
        self.declared.close()


@dataclass(slots=True)
class ZenohQuery:
    """A query, answered once and then dropped: an undropped one keeps its asker waiting."""

    inner: Any

    @property
    def key(self) -> str:
        """The key expression that was asked."""
        return str(self.inner.key_expr)

    @property
    def payload(self) -> bytes:
        """The payload and envelope of the query."""
        payload = self.inner.payload
        return payload.to_bytes() if payload is not None else b""

    def reply(self, payload: bytes, *, error: bool = False) -> None:
        """Answer; an asker that has gone is no error."""
        with contextlib.suppress(zenoh.ZError):
            if error:
                self.inner.reply_err(payload)
            else:
                self.inner.reply(self.inner.key_expr, payload)
        self.inner.drop()

    def drop(self) -> None:
        """Leave it to others to answer."""
        self.inner.drop()


class ZenohBus:
    """A session as the kit sees it. Sinks run on network threads and must only pass the item on."""

    def __init__(self, session: LastingSession, *, lockstep: bool = False) -> None:
        """Take over an open session; in step, sensor streams are reliable too."""
        self._session = session
        self._lockstep = lockstep
        self._shared = SharedMemory()

    def publisher(self, key: str, encoding: str, *, reliable: bool) -> ZenohPublisher:
        """Declare a publisher: a reliable one blocks within bounds, another drops."""
        block = reliable or self._lockstep
        control = zenoh.CongestionControl.BLOCK if block else zenoh.CongestionControl.DROP

        def make(session: zenoh.Session) -> Any:
            return session.declare_publisher(key, encoding=encoding, congestion_control=control)

        return ZenohPublisher(key, self._session.declare(make), self._shared)

    def subscribe(self, key: str, sink: Sink) -> Declared:
        """Hand raw samples to ``sink`` on the network thread: a queue's ``put`` costs no Python frame there."""
        return self._session.declare(lambda s: s.declare_subscriber(key, Direct(sink, indirect=False)))

    def serve(self, key: str, sink: Sink) -> Declared:
        """Hand raw queries to ``sink`` on the network thread."""
        return self._session.declare(lambda s: s.declare_queryable(key, Direct(sink, indirect=False), complete=False))

    def open_sample(self, item: Any) -> Sample | None:
        """Copy a raw sample out of the session's memory; None if that has been taken back by the writer meanwhile."""
        if type(item) is not zenoh.Sample:
            return None
        attached = item.attachment
        attachment = attached.to_bytes() if attached is not None else b""
        payload = _copied(item.payload)
        if payload is None:
            return None
        return tuple.__new__(Sample, (str(item.key_expr), payload, attachment, str(item.encoding)))

    def open_query(self, item: Any) -> ZenohQuery | None:
        """Wrap a raw query."""
        return ZenohQuery(item) if type(item) is zenoh.Query else None

    def query(self, key: str, payload: bytes, timeout: float, *, all_of_them: bool = False) -> list[Answer]:
        """Ask and wait; the first answer ends the wait unless all are wanted."""
        answers = []
        wanted = ALL_ANSWERS if all_of_them else FIRST_ANSWER
        try:
            for reply in self._session.now.get(key, payload=payload, timeout=timeout, **wanted):
                answer = _answer(reply)
                if answer is None:
                    continue
                answers.append(answer)
                if not all_of_them:
                    break
        except zenoh.ZError as error:
            self._not_asked(key, error)
        return [answer for answer in answers if answer.payload != b"Timeout"]

    def ask(self, key: str, payload: bytes, timeout: float, done: Callable[[list[Answer]], object]) -> None:
        """Ask; ``done`` runs on a network thread when the first answer is in, or it is sure that there is none.

        It must only pass the answers on: on that thread nothing else arrives meanwhile.
        """
        finished = threading.Lock()

        def take(reply: zenoh.Reply) -> None:
            answer = _answer(reply)
            if answer is not None and answer.payload != b"Timeout" and finished.acquire(blocking=False):
                done([answer])

        def dropped() -> None:
            if finished.acquire(blocking=False):
                done([])

        try:
            # An indirect callback would start a Python thread for every query.
            self._session.now.get(
                key, Direct(take, drop=dropped, indirect=False), payload=payload, timeout=timeout, **FIRST_ANSWER
            )
        except zenoh.ZError as error:
            self._not_asked(key, error)
            dropped()

    def _not_asked(self, key: str, error: zenoh.ZError) -> None:
        """Raise BusError; without a link there is nobody to answer, and that is no error."""
        if not self._session.broken:
            raise BusError(f"cannot ask {key}: {_first_line(error)}") from None

    def announce(self, key: str) -> Declared:
        """Declare a liveliness token."""
        return self._session.declare(lambda s: s.liveliness().declare_token(key))

    def watch(self, key: str, sink: Callable[[Presence], object]) -> Declared:
        """Hand presence to ``sink``, tokens already there first; on a new session all are gone, and come again."""
        present: set[str] = set()

        def tell(sample: zenoh.Sample) -> None:
            token, is_there = str(sample.key_expr), sample.kind == zenoh.SampleKind.PUT
            (present.add if is_there else present.discard)(token)
            sink(Presence(token, present=is_there))

        def make(session: zenoh.Session) -> Any:
            while present:
                sink(Presence(present.pop(), present=False))
            return session.liveliness().declare_subscriber(key, tell, history=True)

        return self._session.declare(make)

    def present(self, key: str, timeout: float) -> list[str]:
        """Ask for the tokens that are there now, within ``timeout`` seconds.

        Zenoh 1.10 leaves out of its answer those that it is just reporting to a watcher of this session. For some
        milliseconds on a free machine, the answer of a session that begins to watch is not whole.
        """
        try:
            replies = list(self._session.now.liveliness().get(key, timeout=timeout))
        except zenoh.ZError as error:
            self._not_asked(key, error)
            return []
        return [str(reply.ok.key_expr) for reply in replies if reply.ok is not None]

    def when_renewed(self, call: Callable[[], object]) -> None:
        """Have something called when another session replaces one whose link broke."""
        self._session.when_renewed.append(call)

    def close(self) -> None:
        """Close the session, bounded."""
        self._session.close()


def _copied(payload: zenoh.ZBytes) -> bytes | None:
    """Return the bytes of a payload; None if its writer has taken back the memory in which they were.

    A writer takes shared memory back from readers that give no sign of life for 100 ms. A process that the machine
    keeps from running may find another message in its place.
    """
    # Shared memory is copied as it is, ``to_bytes`` clears what it copies to.
    shared = payload.as_shm() if len(payload) >= SHARED_MEMORY_FROM else None
    if shared is None:
        return payload.to_bytes()
    copied = bytes(shared)
    return copied if shared.is_valid() else None


def _answer(reply: zenoh.Reply) -> Answer | None:
    """Copy an answer out of the session's memory; None if that has been taken back by its writer meanwhile."""
    if reply.ok is not None:
        payload = _copied(reply.ok.payload)
        if payload is None:
            return None
        return Answer(str(reply.ok.key_expr), payload, error=False)
    assert reply.err is not None
    return Answer("", reply.err.payload.to_bytes(), error=True)
