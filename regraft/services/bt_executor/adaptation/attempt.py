"""One adaptation across ticks: asking, waiting, trying again, and what follows in the end."""

from __future__ import annotations

from typing import Any

from regraft.services.bt_executor.adaptation.dialogue import AttemptSteps
from regraft.services.bt_executor.adaptation.node import AdaptNode
from regraft.services.bt_executor.adaptation.port_values.durations import AT_ONCE
from regraft.services.bt_executor.adaptation.port_values.ports import duration_of, policy_of
from regraft.services.bt_executor.adaptation.results import POLICY_PORTS, Result
from regraft.services.bt_executor.leaves.context import Asked


class Attempt:
    """An attempt of a decorator to adapt.

    Attributes:
        failed: Whether it came to nothing, and the author's policy for that is that the decorator fails.
        again_at: When it tries again, None if it does not; in seconds of the tree's clock.
        rests_until: Before this time nothing new is begun: the last one came to nothing.
    """

    def __init__(self, node: AdaptNode) -> None:
        self._node = node
        self._attempt: AttemptSteps | None = None
        self._asked: Asked[Any] | None = None
        self._tries = 0
        self.failed = False
        self.again_at: float | None = None
        self.rests_until = float("-inf")

    @property
    def busy(self) -> bool:
        """Whether an answer or another try is outstanding."""
        return self._attempt is not None or self.again_at is not None

    def begin(self) -> None:
        """Decide, and ask if there is something to ask for."""
        self._tries = 0
        self._try()

    def look(self) -> None:
        """Take an answer that came; try again if it is time."""
        if self.again_at is not None and self._node.now() >= self.again_at - AT_ONCE:
            self.again_at = None
            self._try()
        self._go_on()

    def give_up(self) -> None:
        """Want nothing any more."""
        if self._attempt is not None:
            self._attempt.close()
        self._attempt = self._asked = self.again_at = None
        self.failed = False

    def _try(self) -> None:
        self._tries += 1
        self._attempt = self._node.attempt()
        self._go_on()

    def _go_on(self) -> None:
        while self._attempt is not None and (self._asked is None or self._asked.done):
            try:
                self._asked = next(self._attempt)
            except StopIteration as end:
                self._attempt = self._asked = None
                self._ended(end.value)
            except Exception:
                self._attempt = self._asked = None
                raise

    def _ended(self, result: Result | None) -> None:
        if result is None:
            return
        self._node.tell(result)
        if result.good:
            if self._node.is_external:
                self.rests_until = self._node.now() + duration_of(self._node, "settle")
            return
        self.rests_until = self._node.now() + duration_of(self._node, "retry_after")
        policy = policy_of(self._node, POLICY_PORTS[result.outcome])
        if self._tries <= policy.retries:
            self.again_at = self.rests_until
        else:
            self.failed = policy.fails
