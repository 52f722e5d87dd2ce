"""Snapshots of one component, and its checkpoints, which the host keeps."""

from __future__ import annotations

from regraft.bus_schema.annotations import PlainValue
from regraft.bus_schema.encoding import codec
from regraft.bus_schema.encoding.registry import type_of
from regraft.bus_schema.errors import BadMessage
from regraft.bus_schema.messages.protocol.control import ControlCode, Snapshot
from regraft.component.component import Component, restore_state
from regraft.runtime.core.control_refusal import ControlRefused
from regraft.runtime.lifecycle.state_size import check_size
from regraft.runtime.parts import Parts


class Checkpoints:
    """The snapshots and checkpoints of one component."""

    def __init__(self, parts: Parts) -> None:
        self._parts = parts
        self._assigned = parts.assignment.checkpoint
        self._taken: Snapshot | None = None

    @property
    def keeps_state(self) -> bool:
        """Whether the component has a state to keep."""
        return type(self._parts.component).snapshot is not Component.snapshot

    def snapshot(self, *, with_state: bool = True) -> Snapshot:
        """Return the component's state, if it is wanted, and the position of its numbering.

        A component that has not been activated yet still has the state of its assigned checkpoint.

        Raises:
            ControlRefused: the state is too large.
        """
        parts = self._parts
        state = self._state() if with_state else None
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

    def _state(self) -> PlainValue:
        component, kept = self._parts.component, self._assigned
        if kept is None or kept.version not in component.restorable_versions():
            return component.snapshot()
        is_same = kept.version == component.state_version
        return kept.state if is_same else component.convert_state(kept.state, kept.version)

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

    def restore_assigned(self) -> None:
        """Give the component the state of the checkpoint that came with the assignment, once, if its class takes it."""
        component, checkpoint = self._parts.component, self._assigned
        self._assigned, self._taken = None, checkpoint
        if checkpoint is not None and checkpoint.version in type(component).restorable_versions():
            restore_state(component, checkpoint.state, checkpoint.version)

    def forget_assigned(self) -> None:
        """Restore nothing any more: there is a newer state."""
        self._assigned = None

    def keep_assigned(self) -> None:
        """Restore once more what was restored last: the activation that it was for has failed."""
        self._assigned, self._taken = self._taken, None
