"""Earlier checkpoints of components that an adaptation has started: it may be undone."""

from __future__ import annotations

from collections.abc import Callable


class Trials:
    """The last checkpoint that each component had before its run on trial, until the adaptation is over."""

    def __init__(self) -> None:
        self._before: dict[str, tuple[int, bytes]] = {}

    def begin(self, component: str, revision: int, checkpoint: bytes) -> None:
        """Keep a checkpoint for the case that the adaptation of a revision is undone; a repetition changes nothing."""
        if self._before.get(component, (0, b""))[0] != revision:
            self._before[component] = (revision, checkpoint)

    def undo(self, revision: int) -> dict[str, bytes]:
        """Return the earlier checkpoints by component, where the adaptation of a revision is undone."""
        return {name: self._before.pop(name)[1] for name in self._of(lambda other: other == revision)}

    def settle(self, revision: int) -> None:
        """Forget what is of earlier revisions: those adaptations are final."""
        for name in self._of(lambda other: other < revision):
            del self._before[name]

    def _of(self, wanted: Callable[[int], bool]) -> list[str]:
        return [name for name, (revision, _) in self._before.items() if wanted(revision)]
