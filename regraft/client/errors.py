"""Errors of tools outside the system.

ClientError
├── NoSuchComponent   no living run of that component
├── NoSuchHost        no living host of that name, or none that knows the component
├── NoAnswer          it is there, but did not answer in time
└── ControlRefused    it answered that it will not, or could not; states why

A service that refuses, fails or stays silent raises ``regraft.CallFailed``, as it does inside a component.
"""

from __future__ import annotations

from regraft.bus_schema.messages.protocol.control import ControlCode, ControlError


class ClientError(Exception):
    """Something asked of a running system did not happen; the text states what and why."""


class NoSuchComponent(ClientError):
    """No run of that component is alive."""


class NoSuchHost(ClientError):
    """No host of that name is alive, or none runs the component."""


class NoAnswer(ClientError):
    """A component or host is there, but did not answer in time."""


class ControlRefused(ClientError):
    """A control query was answered with an error; ``code`` and ``problems`` are the other side's."""

    def __init__(self, who: str, error: ControlError) -> None:
        """Make it one line that begins with ``who`` refused."""
        self.code: ControlCode = error.code
        self.problems: tuple[str, ...] = error.problems
        super().__init__(f"{who}: {'; '.join(error.problems) or error.code.value}")
