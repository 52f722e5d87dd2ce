"""A decorator that asks a script before it runs the child."""

from collections.abc import Callable

from ..nodes.decorator import Decorator
from ..nodes.node import Node, NodeSetup
from ..nodes.ports import Input
from ..script import compile_condition
from ..status import COMPLETED, FAILURE, Status


def _never() -> bool:
    return False


class Precondition(Decorator):
    """Runs the child to its end if a script is true at the start, else returns a status.

    As in BehaviorTree.CPP, neither a halt nor a skipped child undoes that the script was found true: the next
    start goes straight to the child.
    """

    condition = Input(str, name="if", description="the script")
    otherwise = Input(Status, name="else", default=FAILURE, description="the status while the script is false")

    def __init__(self, setup: NodeSetup) -> None:
        super().__init__(setup)
        self._text = ""
        self._holds: Callable[[], bool] = _never
        self._started = False

    def adopt(self, children: tuple[Node, ...]) -> None:
        """Take the child and compile a script that is given as a literal."""
        super().adopt(children)
        if "if" not in self.setup.attributes or self.has_literal("if"):
            self._compile(self.condition)

    def tick(self) -> Status:
        """Ask the script unless the child has started, then tick the child."""
        self._compile(self.condition)
        if not self._started:
            otherwise = self.otherwise
            self._started = self._holds()
            if not self._started:
                return otherwise
        status = self.child.execute_tick()
        if status in COMPLETED:
            self._started = False
            self.child.reset()
        return status

    def _compile(self, text: str) -> None:
        if text != self._text:
            self._holds = compile_condition(
                text, self.blackboard, self.runtime.enums, extensions=self.runtime.extensions
            )
            self._text = text
