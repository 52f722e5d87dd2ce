"""Hands a live component over to its successor, another process of the same name, losing and doubling nothing.

Three parties: the *incumbent*, which speaks for the component; the *successor*, a run with a higher incarnation that
was started next to it; the adaptation manager, which decides when, and carries nothing. One run speaks at a time:

1. The successor, *waiting*, asks the incumbent to ``prepare`` (nothing changes there) and configures. It subscribes to
  all that the component reads, declares all that it writes, and keeps what arrives. Its own publications, markers and
  status, come from the source ``NAME+``, so that no reader takes it for the component. It shows a ``standby`` token.
2. The manager has every writer of its inputs put markers until it has seen them. It has the successor put markers until
  every reader of its outputs has seen those. These are the steps of rewiring. Now the successor misses nothing, and all
  its readers receive it.
3. The manager asks it to ``take_over``. It asks the incumbent to ``pull``, and reports from where on it holds each
  source's samples itself.
4. The incumbent continues until it has handled everything before that (``CATCH_UP``), then takes no more messages. It
  lets services and handlers under way finish (``DRAIN``), and is *frozen*. It answers with its state and its unhandled
  messages. The answer has how far each source is handled and each output numbered, and its services' replies and goals.
5. The successor restores the state, becomes active and begins the goals again. It handles what was left over, then what
  it holds itself, in sequence. Now it is *live*: with its own incarnation, and the epoch and numbering of the
  incumbent.
6. The incumbent stays frozen and keeps what arrives, until the manager asks it to ``retire``, to ``resume``, or to
  ``take_over``. With ``take_over`` it gets the present state back: what was changed is undone.

The state after a failure, and its repair:

- The successor is refused, dies or hangs before step 4: the incumbent is live, unchanged. The manager ends the
  successor and asks the incumbent to ``resume``, which bars a ``pull`` that is still under way.
- The successor dies or hangs after step 4 but not yet live: nobody speaks. The manager ends it, for certain, and asks
  the incumbent to ``resume``: it handles all that has come meanwhile. Nothing is lost or doubled.
- The successor dies when it is live: the same. The incumbent handles again, from its own state, what the successor had
  handled. Its outputs have the same numbers, which their readers drop. The successor's last outputs may have come
  further: the incumbent listened to them while it was frozen, and numbers on from there. A run that resumes after its
  successor was asked to take over needs a new incarnation, higher than the successor's. Readers refuse the former one.
  The goals that the component had given fail: the successor has cancelled them.
- The incumbent dies or hangs before it answers: the successor reports it within ``PULL_TIMEOUT``, and continues to
  wait. The manager ends the incumbent, for certain, and asks the successor to ``promote`` itself. It goes live without
  the state, in an epoch of its own, and handles all since its last pull.
- The incumbent dies when it is frozen: the successor is live, nothing is missed.
- The manager dies: a waiting run waits, a frozen one stays frozen, a take-over under way is finished or fails as above.
  Its successor asks both to ``read`` their roles: one is live, or else the frozen one is to resume.

While it waits or is frozen a run sits in ``stand_still``, called from where it was asked: no handler, timer or task
runs, and the loop of a live component knows nothing of all this.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from regraft.bus_schema.encoding import codec
from regraft.bus_schema.messages.protocol.handover import Handover, HandoverStep, Role
from regraft.runtime.core.pending import Pending
from regraft.runtime.handover.incumbent import Incumbent
from regraft.runtime.handover.standby import Standby
from regraft.runtime.handover.successor import Successor
from regraft.runtime.handover.transfer import Transfer
from regraft.runtime.lifecycle.answering import Answering
from regraft.runtime.lifecycle.connections import Connections
from regraft.runtime.lifecycle.fence import Fence
from regraft.runtime.lifecycle.lifecycle import Lifecycle
from regraft.runtime.parts import Parts


class HandoverProtocol:
    """One run's part in hand-overs."""

    def __init__(
        self,
        parts: Parts,
        lifecycle: Lifecycle,
        connections: Connections,
        transfer: Transfer,
        answering: Answering,
        fence: Fence,
        standing: Standby,
        take: Callable[[Any], None],
    ) -> None:
        self._fence = fence
        self._standing = standing
        self._incumbent = Incumbent(parts, lifecycle, transfer, answering, standing, take)
        self._successor = Successor(parts, lifecycle, connections, transfer, answering, standing, self._incumbent)
        self._steps: dict[HandoverStep, Callable[[Handover], object]] = {
            HandoverStep.READ: lambda _: {},
            HandoverStep.PREPARE: self._incumbent.prepare,
            HandoverStep.TAKE_OVER: self._successor.take_over,
            HandoverStep.PULL: self._incumbent.pull,
            HandoverStep.PROMOTE: self._successor.promote,
            HandoverStep.RESUME: self._incumbent.resume,
            HandoverStep.RETIRE: self._incumbent.retire,
        }

    @property
    def role(self) -> Role:
        """Whether this run speaks for its component."""
        return self._standing.role

    def step(self, payload: bytes) -> object:
        """Perform one step; returns the answer, or that it has to wait.

        Raises:
            ControlRefused: it came from a former term, does not fit the role, or failed.
        """
        asked = codec.decode(payload, Handover) if payload else Handover(HandoverStep.READ)
        if asked.step not in (HandoverStep.READ, HandoverStep.PREPARE):
            self._fence.check(asked.term)
        return self._told(self._steps[asked.step](asked))

    def _told(self, answer: object) -> object:
        if isinstance(answer, Pending):
            finish = answer.finish
            answer.finish = lambda: self._told(finish())
            return answer
        if isinstance(answer, dict):
            return {"role": self.role.value, "problems": list(self._successor.problems), **answer}
        return answer

    def stand_by(self) -> None:
        """Begin as a successor: returns when this run has become live, or is to end."""
        self._successor.stand_by()

    def end(self) -> None:
        """End this run, in any role."""
        self._incumbent.end()

    def leave(self) -> None:
        """Disappear from the standby place."""
        self._standing.leave()
