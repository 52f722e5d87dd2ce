"""Why a control query does not do what it is asked."""

from __future__ import annotations

from regraft.bus_schema.messages.protocol.control import ControlCode


class ControlRefused(Exception):
    """A control query that is answered with an error."""

    def __init__(self, code: ControlCode, *problems: str) -> None:
        self.code = code
        self.problems = problems
        super().__init__("; ".join(problems))
