"""One adaptation across ticks: asking, waiting, trying again, and what follows in the end."""

from __future__ import annotations

from typing import Any

from regraft.services.bt_executor.adaptation.dialogue import AttemptSteps
from regraft.services.bt_executor.adaptation.node import AdaptNode
from regraft.services.bt_executor.adaptation.port_values.durations import AT_ONCE
from regraft.services.bt_executor.adaptation.port_values.terms import BAD_VALUES, Terms, terms_of
from regraft.services.bt_executor.adaptation.results import POLICY_PORTS, REJECTED, Result
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
        self._terms = Terms()
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
        self._attempt = self._steps()
        self._go_on()

    def _steps(self) -> AttemptSteps:
        """Attempt; what makes no sense in a port is rejected, like any adaptation that cannot be."""
        self._terms = terms_of(self._node)
        if self._terms.problem:
            return Result(REJECTED, self._terms.problem)
        try:
            return (yield from self._node.attempt())
        except BAD_VALUES as error:
            return Result(REJECTED, str(error))

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
        if result.choice is not None:
            self._node.tell_choice(result.choice)
        self._node.tell(result)
        if result.good:
            if self._node.is_external:
                self.rests_until = self._node.now() + self._terms.settle
            return
        self.rests_until = self._node.now() + self._terms.retry_after
        policy = self._terms.policies[POLICY_PORTS[result.outcome]]
        if self._tries <= policy.retries:
            self.again_at = self.rests_until
        else:
            self.failed = policy.fails
