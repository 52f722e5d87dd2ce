"""Nodes that choose a child by the value of a variable."""

from collections.abc import Mapping
from typing import ClassVar

from ..data.values import parse_int, parse_real
from ..nodes.control_node import Control
from ..nodes.node import NodeSetup
from ..nodes.ports import Input
from ..script.operators import TOLERANCE
from ..status import RUNNING, SKIPPED, Status


def same_value(first: str, second: str, enums: Mapping[str, int]) -> bool:
    """Return whether two texts mean the same: as text, as (enumerated) whole numbers, or as reals."""
    if first == second:
        return True
    try:
        return _whole(first, enums) == _whole(second, enums)
    except ValueError:
        pass
    try:
        return abs(parse_real(first) - parse_real(second)) <= TOLERANCE
    except ValueError:
        return False


def _whole(text: str, enums: Mapping[str, int]) -> int:
    return enums[text] if text in enums else parse_int(text)


class Switch2(Control):
    """Ticks the child whose case equals the variable, or the last child if none does."""

    min_children: ClassVar[int] = 3
    max_children: ClassVar[int | None] = 3

    variable = Input(str, description="what is compared with the cases")
    case_1 = Input(str, description="chooses the first child")
    case_2 = Input(str, description="chooses the second child")

    def __init__(self, setup: NodeSetup) -> None:
        super().__init__(setup)
        self._cases = [f"case_{number}" for number in range(1, self.min_children)]
        self._running: int | None = None

    def tick(self) -> Status:
        """Choose again, halt what ran before if it was another child, and tick the chosen one."""
        chosen = self._choice()
        if self._running is not None and self._running != chosen:
            self.children[self._running].reset()
        status = self.children[chosen].execute_tick()
        self._running = chosen if status == RUNNING else None
        if status not in (RUNNING, SKIPPED):
            self.reset_children()
        return status

    def halt(self) -> None:
        """Reset all children and forget the choice."""
        self._running = None
        super().halt()

    def _choice(self) -> int:
        variable = self.read_port_or("variable")
        if variable is not None:
            for index, case in enumerate(self._cases):
                value = self.read_port_or(case)
                if value is not None and same_value(variable, value, self.runtime.enums):
                    return index
        return len(self._cases)


class Switch3(Switch2):
    """A Switch with three cases."""

    min_children: ClassVar[int] = 4
    max_children: ClassVar[int | None] = 4
    case_3 = Input(str, description="chooses the third child")


class Switch4(Switch3):
    """A Switch with four cases."""

    min_children: ClassVar[int] = 5
    max_children: ClassVar[int | None] = 5
    case_4 = Input(str, description="chooses the fourth child")


class Switch5(Switch4):
    """A Switch with five cases."""

    min_children: ClassVar[int] = 6
    max_children: ClassVar[int | None] = 6
    case_5 = Input(str, description="chooses the fifth child")


class Switch6(Switch5):
    """A Switch with six cases."""

    min_children: ClassVar[int] = 7
    max_children: ClassVar[int | None] = 7
    case_6 = Input(str, description="chooses the sixth child")
