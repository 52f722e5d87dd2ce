"""The server's side of services and actions: every request is answered once, and again when it is asked again."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable, Container, Iterable
from dataclasses import dataclass, field
from typing import Any

from regraft.bus.interface import Sample
from regraft.bus_schema.encoding import codec
from regraft.bus_schema.encoding.envelope import Envelope
from regraft.bus_schema.encoding.registry import type_of
from regraft.bus_schema.errors import BadMessage
from regraft.bus_schema.keys import Keys
from regraft.bus_schema.messages.protocol.handover import ServedClient
from regraft.bus_schema.messages.protocol.refusal_codes import RefusalCode
from regraft.bus_schema.messages.protocol.requests import Answer, Reply, Request, Verb
from regraft.bus_schema.texts import encodable, told
from regraft.component.errors import RequestRefused
from regraft.component.future import Cancelled
from regraft.component.handlers import Service
from regraft.runtime.core.tasks import RunningTask, Tasks
from regraft.runtime.data.inputs import Reporter
from regraft.runtime.data.writers import Writers
from regraft.runtime.requests.first_wait import FirstWait

MAX_CLIENTS = 256
MAX_REQUESTS = 2000
RETRY_AFTER = 1.0
"""Requests to one service that may be under way, and the seconds after which one more may be welcome."""
REMEMBERED_REPLIES = 32
"""Replies kept per client for when they are asked for again; requests being worked on are kept too."""
REMEMBERED_NUMBERS = 1024
"""Requests per client that are known to be answered, with or without their reply.

A request that was lost comes a second later: newer ones were answered since, but it was not.
"""
WAIT_FOR_CLIENT = 0.1
WAIT_WHEN_SOME_ARE_GONE = 0.01
"""Seconds that the first reply waits for its client's subscription; less for a while after one that never came."""
ALONE_FOR = 0.5
"""Seconds without a subscription to its replies after which a goal's client is gone: another link takes less."""
GONE = "its client is gone"


@dataclass(slots=True)
class RunningGoal:
    """A goal being pursued for a client, asked for by ``source``; ``alone_since`` when that does not listen."""

    client: str
    number: int
    source: str = ""
    outlives: bool = False
    alone_since: float | None = None
    task: RunningTask | None = None
    why_ended: str = ""


@dataclass(slots=True)
class _Client:
    """The record of one client: requests under way, its last replies, and the numbers answered before.

    ``forgotten`` is the highest number of which it is not known any more whether it was answered.
    """

    open: dict[int, Request] = field(default_factory=dict)
    replies: OrderedDict[int, Reply] = field(default_factory=OrderedDict)
    answered: OrderedDict[int, None] = field(default_factory=OrderedDict)
    forgotten: int = 0

    def remember(self, number: int, reply: Reply) -> None:
        self.open.pop(number, None)
        self.replies[number] = reply
        if len(self.replies) > REMEMBERED_REPLIES:
            oldest, _ = self.replies.popitem(last=False)
            self.answered[oldest] = None
        if len(self.answered) > REMEMBERED_NUMBERS:
            oldest, _ = self.answered.popitem(last=False)
            self.forgotten = max(self.forgotten, oldest)

    def is_too_old(self, number: int) -> bool:
        return number <= self.forgotten or number in self.answered


def _refusal_to(request: Request, why: RequestRefused) -> Reply:
    return Reply(request.number, Answer.REFUSED, None, encodable(why.why), why.retry_after, why.code, why.field)


class Server:
    """One offered service or action."""

    reliable = True
    paused = False
    wakes = True

    def __init__(
        self,
        offered: Service,
        name: str,
        method: Callable[[Any], Any],
        keys: Keys,
        writers: Writers,
        tasks: Tasks,
        reporter: Reporter,
        refusal: Callable[[], RequestRefused | None],
    ) -> None:
        """Serve ``method`` under ``name``; ``refusal`` returns why requests are refused now, None if they are not."""
        self.offered = offered
        self.name = name
        self.goals: dict[tuple[str, int], RunningGoal] = {}
        self._method = method
        self._keys = keys
        self._writers = writers
        self._tasks = tasks
        self._reporter = reporter
        self._refusal = refusal
        self._clients: OrderedDict[str, _Client] = OrderedDict()
        self._places: dict[tuple[str, int], int] = {}
        self._first_wait = FirstWait(WAIT_FOR_CLIENT, WAIT_WHEN_SOME_ARE_GONE)
        self._answering = 0

    def wrap(self, around: Callable[[Callable[[Any], Any]], Callable[[Any], Any]]) -> None:
        """Have what ``around`` makes of the method called instead of it."""
        self._method = around(self._method)

    def deliver(self, sample: Sample) -> None:
        """Take a request in its turn."""
        try:
            if sample.encoding != type_of(Request).encoding:
                raise BadMessage(f"has the encoding {sample.encoding!r}, must be {type_of(Request).encoding!r}")
            request = codec.decode(sample.payload, Request)
        except BadMessage as error:
            self.refuse(Envelope.from_bytes(sample.attachment).source, str(error))
            return
        client = self._client(request.client)
        if request.verb is Verb.CANCEL:
            self._cancel(request)
        elif request.number in client.open or request.number in client.replies:
            self._say_again(request, client.replies.get(request.number))
        elif client.is_too_old(request.number):
            why = "newer requests were answered since: this one is too old"
            self._refuse(request, RequestRefused(why, RefusalCode.CONFLICT))
        elif request.verb is Verb.RESULT:
            why = "this goal is not known here (the component was restarted)"
            self._refuse(request, RequestRefused(why, RefusalCode.NOT_FOUND))
        else:
            self._begin(request, client, Envelope.from_bytes(sample.attachment).source)

    def _client(self, name: str) -> _Client:
        client = self._clients.get(name)
        if client is None:
            client = self._clients[name] = _Client()
            self._forget_clients(but=name)
        self._clients.move_to_end(name)
        return client

    def _forget_clients(self, but: str) -> None:
        """Forget those that have asked longest ago, if there are too many, and have nothing under way."""
        if len(self._clients) <= MAX_CLIENTS:
            return
        idle = [name for name, client in self._clients.items() if not client.open and name != but]
        for forgotten in idle[: len(self._clients) - MAX_CLIENTS]:
            del self._clients[forgotten]
            self._forget_writer(self._keys.reply(self.name, forgotten))

    def _forget_writer(self, key: str) -> None:
        """Undeclare the key of a client; one that still listens may ask again, and drops numbers that come twice."""
        writer = self._writers.open_keys.get(key)
        if writer is not None and writer.matched:
            self._writers.close(key)
        else:
            self._writers.retire(key)

    def _begin(self, request: Request, client: _Client, source: str) -> None:
        refusal = self._refusal()
        if refusal is not None:
            self._refuse(request, refusal)
            return
        if (request.verb is Verb.GOAL) != self.offered.action:
            why = f"{self.name} is {'an action: give it a goal' if self.offered.action else 'a service: call it'}"
            self._refuse(request, RequestRefused(why, RefusalCode.MALFORMED))
            return
        try:
            body: Any = codec.from_plain(request.body, self.offered.request)
        except BadMessage as error:
            self._refuse(request, RequestRefused.malformed(error))
            return
        if 1 < self.offered.goals <= len(self._pursued):
            why = f"{self.name} pursues {self.offered.goals} goals already, and no more at once: cancel one, or wait"
            # It stays refused: the request may come again when its client has given up.
            client.remember(request.number, self._refuse(request, RequestRefused(why, RefusalCode.BUSY)))
            return
        if self._answering >= MAX_REQUESTS:
            why = f"{self.name} has {MAX_REQUESTS} requests under way, and takes no more at once"
            full = RequestRefused(why, RefusalCode.QUEUE_FULL, retry_after=RETRY_AFTER)
            client.remember(request.number, self._refuse(request, full))
            return
        client.open[request.number] = request
        self._do(request, body, source)

    def _do(self, request: Request, body: Any, source: str) -> None:
        if self.offered.action:
            self._pursue(request, body, source)
        else:
            self._answer(request, body, source)

    def _answer(self, request: Request, body: Any, source: str) -> None:
        try:
            value = self._method(body)
        except Exception as error:
            self._finish(request, None, error)
            return
        if not (hasattr(value, "send") and hasattr(value, "throw")):
            self._finish(request, value, None)
            return

        def done(result: Any, error: BaseException | None) -> None:
            self._answering -= 1
            self._finish(request, result, error)

        self._answering += 1
        self._tasks.spawn(self.name, value, done, answers=True, asked_by=source)

    def _pursue(self, request: Request, body: Any, source: str) -> None:
        goal = RunningGoal(request.client, request.number, source, request.outlives)
        # Of several goals one is too many only for a successor whose class pursues fewer.
        for other in self._pursued[: len(self._pursued) + 1 - max(1, self.offered.goals)]:
            self._end_goal(other, "replaced by a newer goal")
        self.goals[request.client, request.number] = goal
        self._reply(request, Answer.ACCEPTED)

        def done(result: Any, error: BaseException | None) -> None:
            self.goals.pop((request.client, request.number), None)
            self._finish(request, result, error, goal.why_ended)

        goal.task = self._tasks.spawn(self.name, self._method(body), done, goal=(self, request), asked_by=source)

    @property
    def _pursued(self) -> list[RunningGoal]:
        """The goals that are not being ended, the oldest first."""
        return [goal for goal in self.goals.values() if not goal.why_ended]

    def feedback(self, request: Request, message: object) -> None:
        """Send feedback to a goal's client; raises TypeError if it is not of the declared type."""
        if type(message) is not self.offered.feedback:
            declared = self.offered.feedback.__name__ if self.offered.feedback else "nothing"
            raise TypeError(f"gives {type(message).__name__} as feedback, and declares {declared}")
        self._reply(request, Answer.FEEDBACK, codec.to_plain(message))

    def end_goals(self, why: str) -> None:
        """Cancel all goals being pursued."""
        for goal in list(self.goals.values()):
            self._end_goal(goal, why)

    def end_goals_of(self, members: tuple[str, ...]) -> None:
        """Cancel the goals of members whose run has ended, but for those that outlive it."""
        for goal in list(self.goals.values()):
            if not goal.outlives and goal.client.rpartition("-")[0] in members:
                self._end_alone(goal)

    def end_goals_of_nobody(self, now: float, among: Container[str] | None) -> None:
        """Cancel the goals, of all clients or ``among`` some, whose client has not listened for a while.

        ``now`` is in monotonic seconds. A client listens to its replies as long as it runs: also one that hangs does.
        """
        for goal in list(self.goals.values()):
            if goal.outlives or (among is not None and goal.source not in among):
                continue
            writer = self._writers.open_keys.get(self._keys.reply(self.name, goal.client))
            if writer is None or writer.matched:
                goal.alone_since = None
            elif goal.alone_since is None:
                goal.alone_since = now
            elif now - goal.alone_since >= ALONE_FOR:
                self._end_alone(goal)

    def _end_alone(self, goal: RunningGoal) -> None:
        if not goal.why_ended:
            self._reporter.event("goal.cancelled", f"{self.name}: the goal of {goal.client} is cancelled: {GONE}")
            self._end_goal(goal, GONE)

    @staticmethod
    def _end_goal(goal: RunningGoal, why: str) -> None:
        goal.why_ended = why
        if goal.task:
            goal.task.cancel()

    def _cancel(self, request: Request) -> None:
        goal = self.goals.get((request.client, request.number))
        if goal:
            self._end_goal(goal, "cancelled by its client")
        else:
            client = self._client(request.client)
            self._say_again(request, client.replies.get(request.number))

    def _finish(self, request: Request, value: Any, error: BaseException | None, why: str = "") -> None:
        try:
            reply = self._final_reply(request, value, error, why)
            payload = codec.encode(reply)
        except (TypeError, BadMessage) as wrong:
            self._reporter.fault(self.name, wrong)
            text = str(wrong) if error is None else f"{told(error)} (no reply can hold it: {wrong})"
            reply = Reply(request.number, Answer.FAILED, None, encodable(text))
            payload = codec.encode(reply)
        # First of all: if it cannot be put now, it is there when it is asked for again.
        self._client(request.client).remember(request.number, reply)
        self._put(request.client, payload)

    def _final_reply(self, request: Request, value: Any, error: BaseException | None, why: str) -> Reply:
        if error is None:
            if type(value) is not self.offered.reply:
                raise TypeError(f"returned {type(value).__name__}, not {self.offered.reply.__name__}")
            return Reply(request.number, Answer.RESULT, codec.to_plain(value))
        if isinstance(error, Cancelled):
            return Reply(request.number, Answer.CANCELLED, None, why or "cancelled")
        if isinstance(error, RequestRefused):
            return _refusal_to(request, error)
        self._reporter.fault(self.name, error)
        return Reply(request.number, Answer.FAILED, None, told(error))

    def _say_again(self, request: Request, reply: Reply | None) -> None:
        if reply is not None:
            self._put(request.client, codec.encode(reply))
        elif self.offered.action and (request.client, request.number) in self.goals:
            self._reply(request, Answer.ACCEPTED)

    def _reply(self, request: Request, answer: Answer, body: Any = None) -> None:
        self._put(request.client, codec.encode(Reply(request.number, answer, body)))

    def _refuse(self, request: Request, why: RequestRefused) -> Reply:
        reply = _refusal_to(request, why)
        self._put(request.client, codec.encode(reply))
        return reply

    def _put(self, client: str, payload: bytes) -> None:
        writer = self._writers.open(self._keys.reply(self.name, client), type_of(Reply).encoding)
        self._first_wait.wait(writer)
        writer.put(payload)

    # --- from one run to the next ---

    def hand_over(self) -> tuple[ServedClient, ...]:
        """Return what is remembered of every client, who asked last coming last."""
        places = {goal: place for place, goal in enumerate(self.goals)}
        return tuple(
            ServedClient(
                self.name,
                name,
                c.forgotten,
                tuple(c.answered),
                tuple(c.replies.values()),
                tuple(c.open.values()),
                tuple(places.get((name, number), 0) for number in c.open) if self.offered.action else (),
            )
            for name, c in self._clients.items()
        )

    def take_over(self, clients: Iterable[ServedClient]) -> None:
        """Remember clients as the run before did, and nothing else."""
        self._clients.clear()
        self._places.clear()
        for client in clients:
            replies = OrderedDict((reply.number, reply) for reply in client.replies)
            under_way = {request.number: request for request in client.under_way}
            answered = OrderedDict.fromkeys(client.answered)
            self._clients[client.client] = _Client(under_way, replies, answered, client.forgotten)
            goals = ((client.client, number) for number in under_way)
            self._places.update(zip(goals, client.places, strict=False))

    def begin_again(self, sources: Container[str]) -> None:
        """Do what the run before had begun and not ended: goals, the oldest first, and what it could not finish.

        ``sources`` are those of its requests. A client has the name of its source, or that and an epoch.
        """
        under_way = [(name, request) for name, client in self._clients.items() for request in client.open.values()]
        under_way.sort(key=lambda each: self._places.get((each[0], each[1].number), 0))
        for name, request in under_way:
            source = next((each for each in (name, name.rpartition("-")[0]) if each in sources), name)
            try:
                self._do(request, codec.from_plain(request.body, self.offered.request), source)
            except BadMessage as error:
                self._finish(request, None, error)

    def refuse(self, source: str, why: str) -> None:
        """Count and report a request that cannot be handled."""
        self._reporter.refused(f"service {self.name!r}", source, why)

    def report_lost(self, source: str, count: int) -> None:
        """Count and report requests that never came."""
        self._reporter.lost(f"service {self.name!r}", source, count)
