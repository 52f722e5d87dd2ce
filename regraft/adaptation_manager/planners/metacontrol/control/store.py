"""The objectives that clients have given, and what has become of each."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Final

from regraft import RefusalCode, RequestRefused
from regraft.adaptation_manager.planners.metacontrol.control.translation import Translator
from regraft.adaptation_manager.planners.metacontrol.knowledge.model import Objective as ModelObjective
from regraft.bus_schema.annotations import PlainValue
from regraft.bus_schema.encoding import codec
from regraft.bus_schema.messages.management.objectives import Attempt, Objective, Progress
from regraft.bus_schema.suggestions import no_such

LISTED: Final = "objectives.{}."
MAX_OBJECTIVES: Final = 64
MAX_ATTEMPTS: Final = 10
"""Failures that are remembered of an objective."""


@dataclass(slots=True)
class Entry:
    """An objective as it was given, and as the knowledge base has it.

    ``owners`` are the goals that it belongs to; ``ownerless_since`` is when they were lost. ``released`` is whether the
    last of them was cancelled. ``is_kept`` is whether it was also given without a goal: then it is independent of them.
    """

    given: Objective
    objective: ModelObjective
    owners: set[str] = field(default_factory=set)
    ownerless_since: float | None = None
    released: bool = False
    is_kept: bool = False
    progress: Progress = Progress.INPROGRESS
    attempts: list[Attempt] = field(default_factory=list)

    def note(self, attempt: Attempt) -> None:
        """Remember a failure."""
        self.attempts = [*self.attempts, attempt][-MAX_ATTEMPTS:]

    def own(self, owner: str) -> None:
        """Belong to one more goal; with an empty one, stay until it is cancelled by its name."""
        if not owner:
            self.is_kept = True
            return
        self.owners.add(owner)
        self.ownerless_since, self.released = None, False

    def release(self, owner: str) -> None:
        """Note that a goal was cancelled; with the last one, the objective is over."""
        if owner in self.owners:
            self.owners.remove(owner)
            self.released = not self.owners


class ObjectiveStore:
    """The objectives by name, in the order in which they were given."""

    def __init__(self, translator: Translator) -> None:
        self._translator = translator
        self._entries: dict[str, Entry] = {}

    def __contains__(self, name: str) -> bool:
        """Return whether there is an objective of that name."""
        return name in self._entries

    def __iter__(self) -> Iterator[Entry]:
        """Yield all objectives."""
        return iter(list(self._entries.values()))

    def __getitem__(self, name: str) -> Entry:
        """Return an objective; raises RequestRefused with the nearest name."""
        if name not in self._entries:
            raise RequestRefused(no_such("objective", name, self._entries), RefusalCode.NOT_FOUND, field="objective")
        return self._entries[name]

    @property
    def names(self) -> tuple[str, ...]:
        """The names of all objectives."""
        return tuple(self._entries)

    def add(self, given: Sequence[Objective], owner: str = "", where: str = LISTED) -> list[Entry]:
        """Add objectives, all or none; raises RequestRefused. An equal one of a present name is that one."""
        found = self.prepared(given, where)
        for entry in found:
            entry.own(owner)
            self._entries[entry.given.name] = entry
        return found

    def prepared(self, given: Sequence[Objective], place: str = LISTED) -> list[Entry]:
        """Return objectives as they would be added, with nothing added; raises RequestRefused.

        ``place`` is the place of an objective's fields in the request, with its index in place of ``{}``.
        """
        found: dict[str, Entry] = {}
        for index, each in enumerate(given):
            named = replace(each, name=each.name or each.skill, operators={})
            where = place.format(index)
            known = self._entries.get(named.name)
            if named.name in found or (known is not None and known.given != named):
                why = f"there is another objective {named.name!r}: cancel it, or give this one a name of its own"
                raise RequestRefused(why, RefusalCode.CONFLICT, field=f"{where}name")
            objective = self._translator.objective(replace(named, operators=each.operators), where)
            found[named.name] = known or Entry(named, objective)
        if len(self._entries | found) > MAX_OBJECTIVES:
            why = f"there would be {len(self._entries | found)} objectives, must be at most {MAX_OBJECTIVES}"
            raise RequestRefused(why, RefusalCode.QUEUE_FULL)
        return list(found.values())

    def remove(self, name: str) -> None:
        """Remove an objective that is over."""
        self._entries.pop(name, None)

    def of_task(self, task: str) -> list[str]:
        """Return the names of a task's objectives; raises RequestRefused if it has none."""
        found = [entry.given.name for entry in self if entry.given.task == task]
        if not found:
            tasks = {entry.given.task for entry in self} - {""}
            raise RequestRefused(no_such("task", task, tasks), RefusalCode.NOT_FOUND, field="task")
        return found

    # --- goals ---

    def disown(self) -> None:
        """Note that all goals have ended with the component's activity: their clients may come back."""
        for entry in self:
            if entry.owners or entry.released:
                entry.owners, entry.ownerless_since, entry.released = set(), 0.0, False

    def wait_for_clients(self, now: float) -> None:
        """Wait from now on for clients whose goals were lost."""
        for entry in self:
            if entry.ownerless_since is not None:
                entry.ownerless_since = now

    def over(self, now: float, orphan_after: float) -> list[str]:
        """Return the objectives whose clients have all cancelled their goals, or have not come back."""
        return [
            entry.given.name
            for entry in self
            if not entry.is_kept
            and (entry.released or (entry.ownerless_since is not None and now - entry.ownerless_since >= orphan_after))
        ]

    # --- memory ---

    def remembered(self) -> list[PlainValue]:
        """Return what a further run has to know, as plain data."""
        return [
            {
                "given": codec.to_plain(entry.given),
                "had_owner": bool(entry.owners) or entry.released or entry.ownerless_since is not None,
                "is_kept": entry.is_kept,
                "progress": entry.progress.value,
                "attempts": [codec.to_plain(each) for each in entry.attempts],
            }
            for entry in self
        ]

    def restore(self, remembered: Sequence[Mapping[str, Any]], now: float) -> list[str]:
        """Continue with what an earlier run had; returns why some objectives could not be taken."""
        problems: list[str] = []
        for each in remembered:
            given = codec.from_plain(each["given"], Objective)
            try:
                (entry,) = self.add([given])
            except RequestRefused as error:
                problems.append(f"{given.name}: {error}")
                continue
            entry.ownerless_since = now if each["had_owner"] else None
            entry.is_kept = each["is_kept"]
            entry.progress = Progress(each["progress"])
            entry.attempts = [codec.from_plain(one, Attempt) for one in each["attempts"]]
        return problems
