"""A component on bare Zenoh and MessagePack, without the kit: it follows docs/protocol.md and nothing else.

It repeats each light level it reads, times its parameter ``gain``, tells ten times a second how many it has handled,
and offers the service ``invert``. It runs under the real clock and, where it is told so, in step (``bare_member``).
"""

from __future__ import annotations

import json
import os
import queue
import signal
import sys
import time
from pathlib import Path
from typing import Any

import zenoh

from .bare_member import Member
from .bare_rewiring import Refused, Rewiring
from .bare_wire import Bad, Held, Plain, Stream, Streams, Writer, open_session, unpacked

LIGHT, VECTOR, REQUEST, REPLY = "regraft/LightLevel", "regraft/Vector3", "regraft/Request", "regraft/Reply"
TRANSITIONS = {
    ("unconfigured", "configure"): ("configuring", "inactive"),
    ("inactive", "activate"): ("activating", "active"),
    ("active", "deactivate"): ("deactivating", "inactive"),
    ("inactive", "cleanup"): ("cleaningup", "unconfigured"),
    ("unconfigured", "shutdown"): ("shuttingdown", "finalized"),
    ("inactive", "shutdown"): ("shuttingdown", "finalized"),
    ("active", "shutdown"): ("shuttingdown", "finalized"),
}
COUNT_INTERVAL = 100_000_000
STATE_VERSION = 1
REMEMBERED_REPLIES = 32
GAIN = {
    "name": "gain",
    "default": 1.0,
    "schema": {"type": "number", "minimum": 0.0, "maximum": 1.0},
    "unit": "1",
    "read_only": False,
    "description": "what every level is multiplied by",
}


def port(name: str, direction: str, type_name: str) -> Plain:
    """Return a port's description; its topic is named like the port."""
    return {"name": name, "direction": direction, "type": type_name, "version": 1, "topic": name}


DESCRIPTION: Plain = {
    "class": "bare_component",
    "description": "Repeats light levels, times a gain.",
    "ports": [port("light", "input", LIGHT), port("echo", "output", LIGHT), port("count", "output", VECTOR)],
    "parameters": [GAIN],
    "services": [{"name": "invert", "kind": "service", "request": LIGHT, "reply": LIGHT}],
    "state_version": STATE_VERSION,
    "handler_timeout": 0.3,
}


class BareComponent:
    """The component: everything happens on the thread that calls it, in the order of the inbox."""

    description = DESCRIPTION
    state_version = STATE_VERSION

    def __init__(self, assignment: Plain, session: zenoh.Session) -> None:
        """Know what to be; nothing is declared yet."""
        self.assignment = assignment
        self.session = session
        self.system, self.name = assignment["system"], assignment["name"]
        self.incarnation = self.epoch = assignment.get("incarnation", 1)
        self.stepped = assignment.get("simulated", False)
        self.term = assignment.get("term")
        self.revision = assignment.get("revision", 0)
        self.state = "unconfigured"
        self.error = ""
        self.refused = 0
        self.gain = float(assignment.get("parameters", {}).get("gain", 1.0))
        self.handled = 0
        self.restore_at_start()
        self.time = 0
        self.count_due: int | None = None
        self.inbox: queue.Queue[Any] = queue.Queue()
        self.asked_to_end = False  # by a signal, whose handler must not put into a queue that may be waited for
        self.ready: list[Held] = []
        self.advanced: dict[str, int] = {}
        self.streams = Streams(self.saw_marker)
        self.marker_listeners: list[Any] = []
        self.writers: dict[str, Writer] = {}
        self.closed_writers: dict[str, Writer] = {}
        self.subscriptions: dict[str, Any] = {}
        self.answered: dict[str, dict[int, Plain]] = {}
        self.takers: dict[str, Any] = {}
        self.rewiring = Rewiring(self)
        self.beat_due = 0.0
        self._status = Writer(session, self.key("component", self.name, "status"), "regraft/ComponentStatus", *self.me)
        self._events = Writer(session, self.key("event"), "regraft/Event", *self.me)
        self._declared: list[Any] = []

    @property
    def me(self) -> tuple[str, int, int]:
        """Who writes: source, epoch, incarnation."""
        return self.name, self.epoch, self.incarnation

    def key(self, *parts: object) -> str:
        """Return a key of the system."""
        return "/".join(map(str, (self.system, *parts)))

    def topic_of(self, port_name: str) -> str:
        """Return the topic that a port is assigned."""
        topic: str = self.assignment.get("connect", {}).get(port_name, port_name)
        return topic

    @property
    def service(self) -> str:
        """The name under which ``invert`` is offered."""
        name: str = self.assignment.get("services", {}).get("invert", "invert")
        return name

    @property
    def request_key(self) -> str:
        """Where requests arrive."""
        return self.key("service", self.service, "request")

    def now(self) -> int:
        """Return the time in nanoseconds: simulated, or since 1970."""
        return self.time if self.stepped else time.time_ns()

    def restore_at_start(self) -> None:
        """Take up the checkpoint that came with the assignment, if there is one."""
        path = self.assignment.get("checkpoint_file")
        if path:
            checkpoint = unpacked(Path(path).read_bytes())
            if checkpoint["version"] == STATE_VERSION:
                self.handled = checkpoint["state"]["handled"]

    # --- on the bus ---

    def declare(self) -> None:
        """Appear: control queries, requests, the first status, the token last."""
        control = self.key("component", self.name, self.incarnation, "*")
        self._declared = [self.session.declare_queryable(control, self.inbox.put)]
        self.subscribe(self.request_key)
        self.beat()
        token = self.key("component", self.name, "alive", self.incarnation)
        self._declared.append(self.session.liveliness().declare_token(token))

    def leave(self) -> None:
        """Disappear: first of all the token."""
        for declared in reversed(self._declared):
            declared.undeclare()

    def subscribe(self, key: str) -> None:
        """Read a key."""
        if key not in self.subscriptions:
            self.subscriptions[key] = self.session.declare_subscriber(key, self.inbox.put)

    def unsubscribe(self, key: str) -> None:
        """Read a key no more."""
        subscription = self.subscriptions.pop(key, None)
        if subscription:
            subscription.undeclare()
        self.streams.forget(key)

    def writer(self, key: str, type_name: str) -> Writer:
        """Return the writer of a key; the numbering of one that was closed goes on."""
        if key not in self.writers:
            known = self.closed_writers.pop(key, None)
            if known:
                known.open_again()
            self.writers[key] = known or Writer(self.session, key, type_name, *self.me)
        return self.writers[key]

    def close_writer(self, key: str) -> None:
        """Undeclare a key."""
        writer = self.writers.pop(key, None)
        if writer:
            writer.close()
            self.closed_writers[key] = writer

    def put(self, writer: Writer, message: Plain) -> None:
        """Put a message, and note that its key has advanced."""
        writer.put(message, self.now())
        self.advanced[writer.key] = writer.sequence

    def beat(self) -> None:
        """Put the status, which is the heartbeat too."""
        self.beat_due = time.monotonic() + self.assignment.get("heartbeat", 0.15)
        status = {
            "component": self.name,
            "incarnation": self.incarnation,
            "state": self.state,
            "revision": self.revision,
            "stamp": self.now() / 1e9,
            "error": self.error,
            "lost": self.streams.lost,
            "refused": self.refused,
        }
        self._status.put(status, self.now())

    def beat_if_due(self) -> float:
        """Keep the heartbeat; returns the seconds until the next."""
        if time.monotonic() >= self.beat_due:
            self.beat()
        return max(0.0, self.beat_due - time.monotonic())

    def event(self, kind: str, text: str) -> None:
        """Tell of something that happened."""
        message = {"stamp": self.now() / 1e9, "kind": kind, "subject": self.name, "text": text}
        self._events.put(message, self.now())

    def enter(self, state: str) -> None:
        """Change the state and say so."""
        self.state = state
        self.beat()

    # --- lifecycle ---

    def transition(self, name: str) -> None:
        """Go through a transition; raises Refused where it is not legal."""
        way = TRANSITIONS.get((self.state, name))
        if way is None:
            raise Refused("failed", f"transition {name} is not possible while {self.state}")
        before = self.state
        self.enter(way[0])
        if name == "configure":
            self.rewiring.connect()
        elif name == "activate":
            self.rewiring.pause(False)
            self.count_due = self.now() + COUNT_INTERVAL
        elif name in ("deactivate", "shutdown"):
            self.rewiring.pause(True)
            self.count_due = None
        if name in ("cleanup", "shutdown"):
            self.rewiring.disconnect()
        self.enter(way[1])
        self.event("component.transition", f"{before} to {self.state}")

    def reach(self, goal: str) -> None:
        """Go to an assigned state from the beginning."""
        for name in {"inactive": ["configure"], "active": ["configure", "activate"]}.get(goal, []):
            if (self.state, name) in TRANSITIONS:
                self.transition(name)

    # --- what arrives ---

    def take(self, item: Any) -> None:
        """Take one item from the inbox."""
        if isinstance(item, zenoh.Query):
            self.rewiring.answer(item)
        elif isinstance(item, zenoh.Sample):
            taker = self.takers.get(str(item.key_expr))
            try:
                if taker:
                    taker(item)
                elif str(item.key_expr) in self.subscriptions:
                    paused = str(item.key_expr) != self.request_key and self.rewiring.lets_pass
                    self.ready += self.streams.arrive(item, paused=paused, stepped=self.stepped)
            except Bad as error:
                self.refuse(str(error))
        elif callable(item):
            item()

    def refuse(self, why: str) -> None:
        """Count a message that cannot be handled, and say why."""
        self.refused += 1
        self.error = why

    def saw_marker(self, key: str, source: str, stream: Stream) -> None:
        """Pass the news of a marker on."""
        self.rewiring.saw_marker(key, source, stream)
        for listener in self.marker_listeners:
            listener(key, source, stream)

    def work(self) -> None:
        """Handle all that is ready."""
        while self.ready:
            key, held = self.ready.pop(0)
            try:
                if key == self.request_key:
                    self.serve(held)
                elif self.rewiring.is_for_us(key, held):
                    self.on_light(held)
            except (Bad, KeyError, TypeError) as error:
                self.refuse(f"{key}: {error}")

    def on_light(self, held: Plain) -> None:
        """Handle a light level."""
        level = light_level(held)
        self.handled += 1
        echo = {"stamp": level["stamp"], "darkness": level["darkness"] * self.gain}
        self.put(self.writers[self.rewiring.keys["echo"]], echo)

    def fire(self) -> None:
        """Do what is due by the clock."""
        if self.count_due is not None and self.now() >= self.count_due:
            self.count_due += COUNT_INTERVAL * ((self.now() - self.count_due) // COUNT_INTERVAL + 1)
            self.put(self.writers[self.rewiring.keys["count"]], {"x": float(self.handled)})

    # --- the service ---

    def serve(self, held: Plain) -> None:
        """Answer a request once, and again when it is asked again."""
        if held["encoding"] != f"application/msgpack;{REQUEST}@1":
            raise Bad(f"has the encoding {held['encoding']}")
        request = unpacked(held["payload"])
        client, number = request["client"], request["number"]
        answered = self.answered.setdefault(client, {})
        if request["verb"] == "cancel" and number not in answered:
            return
        if number not in answered:
            reply = self.invert(request)
            if reply["answer"] == "result":
                answered[number] = reply
                for old in sorted(answered)[:-REMEMBERED_REPLIES]:
                    del answered[old]
        else:
            reply = answered[number]
        writer = self.writer(self.key("service", self.service, "reply", client), REPLY)
        if writer.sequence == 0:
            writer.wait_for_reader(0.1)
        self.put(writer, reply)

    def invert(self, request: Plain) -> Plain:
        """Return the reply to a request."""
        number, body = request["number"], request.get("body")
        if request["verb"] == "result":
            return {"number": number, "answer": "refused", "error": "this request is not known here"}
        if request["verb"] != "call":
            return {"number": number, "answer": "refused", "error": f"{self.service} is a service: call it"}
        if self.state != "active":
            return {"number": number, "answer": "refused", "error": f"{self.name} is {self.state}"}
        if not isinstance(body, dict) or not isinstance(body.get("darkness"), float):
            return {"number": number, "answer": "refused", "error": f"{LIGHT} needs a darkness"}
        inverted = {"stamp": body["stamp"], "darkness": 1.0 - body["darkness"]}
        return {"number": number, "answer": "result", "body": inverted}

    # --- the loop under the real clock ---

    def run(self) -> None:
        """Run until finalized."""
        self.declare()
        self.reach(self.assignment.get("state", "active"))
        while self.state != "finalized":
            self.ready += self.streams.overdue()
            self.work()
            self.fire()
            self.rewiring.answer_parked()
            self.pump(min(self.beat_if_due(), 0.05))
        self.leave()

    def pump(self, timeout: float) -> None:
        """Take what arrives within ``timeout`` seconds."""
        if self.asked_to_end:
            self.asked_to_end = False
            self.transition("shutdown")
            return
        try:
            self.take(self.inbox.get(timeout=max(timeout, 0.001)))
        except queue.Empty:
            return
        self.work()


def light_level(held: Plain) -> Plain:
    """Return the light level in a sample; raises Bad."""
    if held["encoding"] != f"application/msgpack;{LIGHT}@1":
        raise Bad(f"has the encoding {held['encoding']}")
    level = unpacked(held["payload"])
    if not isinstance(level.get("darkness"), float) or not 0.0 <= level["darkness"] <= 1.0:
        raise Bad("has no darkness from 0 to 1")
    return level


def main() -> int:
    """Be the component that ``REGRAFT_ASSIGNMENT`` says."""
    assignment = json.loads(os.environ["REGRAFT_ASSIGNMENT"])
    session = open_session(
        assignment["connect_endpoints"], assignment.get("secret", ""), stepped=assignment.get("simulated", False)
    )
    component = BareComponent(assignment, session)

    def ask(*_: object) -> None:
        component.asked_to_end = True

    for signum in (signal.SIGTERM, signal.SIGINT):
        signal.signal(signum, ask)
    if component.stepped:
        Member(component).run()
    else:
        component.run()
    session.close()  # type: ignore[no-untyped-call]  # zenoh's stubs give it no types
    return 0


if __name__ == "__main__":
    sys.exit(main())
