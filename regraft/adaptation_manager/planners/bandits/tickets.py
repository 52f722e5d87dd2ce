"""Tickets: which option earned a utility that is reported later."""

from __future__ import annotations

from dataclasses import dataclass, field

from regraft.adaptation_manager.planners.bandits.credit import Credit, seconds
from regraft.adaptation_manager.planners.choices.in_architecture import not_in_force
from regraft.adaptation_manager.planners.choices.settings import Kind, Setting
from regraft.bus_schema.annotations import PlainValue
from regraft.bus_schema.model.architecture import Architecture

ROUNDING = 1e-6
"""Seconds by which stamps may differ that are meant to be equal."""


@dataclass(slots=True)
class Ticket:
    """A choice that may earn a utility, once, in a window from ``since`` until something else took its place.

    ``low`` and ``high`` are the utility's range, ``context`` the numbers known when the choice was made.
    """

    strategy: str
    key: str
    since: float
    low: float
    high: float
    context: dict[str, float]
    settings: tuple[Setting, ...]
    until: float | None = None
    credited: bool = False

    def refusal(self, credit: Credit, architecture: Architecture) -> str:
        """Return why a credit cannot be given, empty if it can."""
        if self.credited:
            return "this ticket was credited already"
        if credit.begin < self.since - ROUNDING:
            since = f"the effect of the choice can be measured from {seconds(self.since)} on"
            return f"measured from {seconds(credit.begin)}, but {since}"
        if self.until is not None and credit.end > self.until + ROUNDING:
            return f"measured until {seconds(credit.end)}, but the choice stood until {seconds(self.until)} only"
        changed = not_in_force(self.settings, architecture) if self.until is None else []
        if changed:
            what = f"{changed[0].component}.{changed[0].member or 'state'}"
            return f"somebody else has changed {what} since"
        return ""

    def scaled(self, utility: float) -> tuple[float, bool]:
        """Return the utility on a scale of 0 to 1, and whether it had to be clipped."""
        clipped = min(max(utility, self.low), self.high)
        return (clipped - self.low) / (self.high - self.low), clipped != utility

    def state(self) -> PlainValue:
        """Return the ticket as plain data."""
        settings = [[each.component, each.kind.value, each.member, each.value] for each in self.settings]
        numbers = [self.since, self.low, self.high, self.until]
        return [self.strategy, self.key, numbers, self.context, settings, self.credited]


def ticket_from(state: PlainValue) -> Ticket:
    """Return the ticket that ``state`` was taken from."""
    strategy, key, (since, low, high, until), context, settings, credited = state
    parts = tuple(Setting(component, Kind(kind), member, value) for component, kind, member, value in settings)
    return Ticket(strategy, key, since, low, high, context, parts, until, credited)


@dataclass(frozen=True, slots=True)
class Told:
    """The result of a credit."""

    ticket: str
    credited: bool
    utility: float
    why: str = ""
    notes: tuple[str, ...] = field(default=())

    def shown(self) -> PlainValue:
        """Return it as the choice shows it."""
        return {"ticket": self.ticket, "credited": self.credited, "utility": self.utility, "why": self.why}
