"""Why a control query does not do what it is asked."""

from __future__ import annotations

from regraft.bus_schema.messages.protocol.control import ControlCode
from regraft.bus_schema.texts import encodable


class ControlRefused(Exception):
    """A control query that is answered with an error."""

    def __init__(self, code: ControlCode, *problems: str) -> None:
        self.code = code
        self.problems = tuple(encodable(problem) for problem in problems)
        super().__init__("; ".join(self.problems))
