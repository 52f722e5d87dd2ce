"""Snapshots of one component, and its checkpoints, which the host keeps."""

from __future__ import annotations

from regraft.bus_schema.encoding import codec
from regraft.bus_schema.encoding.registry import type_of
from regraft.bus_schema.errors import BadMessage
from regraft.bus_schema.messages.protocol.control import ControlCode, Snapshot
from regraft.component.component import Component
from regraft.runtime.core.control_refusal import ControlRefused
from regraft.runtime.lifecycle.state_size import check_size
from regraft.runtime.parts import Parts


class Checkpoints:
    """The snapshots and checkpoints of one component."""

    def __init__(self, parts: Parts) -> None:
        self._parts = parts
        self._assigned = parts.assignment.checkpoint

    @property
    def keeps_state(self) -> bool:
        """Whether the component has a state to keep."""
        return type(self._parts.component).snapshot is not Component.snapshot

    def snapshot(self, *, with_state: bool = True) -> Snapshot:
        """Return the component's state, if it is wanted, and the position of its numbering.

        Raises:
            ControlRefused: the state is too large.
        """
        parts = self._parts
        state = parts.component.snapshot() if with_state else None
        try:
            check_size(state)
        except BadMessage as error:
            raise ControlRefused(ControlCode.FAILED, f"snapshot: {error}") from None
        return Snapshot(
            parts.assignment.name,
            parts.assignment.incarnation,
            parts.clock.now() / 1e9,
            type(parts.component).state_version,
            state,
            parts.writers.sequences(),
        )

    @staticmethod
    def encoded(snapshot: Snapshot) -> bytes:
        """Return a snapshot as bytes; raises ControlRefused if its state is no plain data."""
        try:
            return codec.encode(snapshot)
        except BadMessage as error:
            raise ControlRefused(ControlCode.FAILED, f"snapshot: {error}") from None

    def publish(self) -> None:
        """Publish a checkpoint, for the host to keep."""
        self.publish_taken(self.snapshot())

    def publish_taken(self, snapshot: Snapshot) -> None:
        """Publish a snapshot that was taken before."""
        key = self._parts.keys.checkpoint(self._parts.assignment.name)
        self._parts.reporter.put(key, type_of(Snapshot), self.encoded(snapshot))

    def take_assigned(self) -> Snapshot | None:
        """Return the checkpoint that came with the assignment, once, if this class can restore it."""
        checkpoint, self._assigned = self._assigned, None
        if checkpoint is None or checkpoint.version not in type(self._parts.component).restorable_versions():
            return None
        return checkpoint
