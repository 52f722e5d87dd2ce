"""The bandits' memory of one task: what each strategy learned, which tickets are out, which options rest."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from random import Random
from typing import Any, Final

from regraft.adaptation_manager.planners.bandits.credit import Credit
from regraft.adaptation_manager.planners.bandits.strategy import CannotLearn, Knobs, Offer, Strategy
from regraft.adaptation_manager.planners.bandits.strategy_registry import Strategies
from regraft.adaptation_manager.planners.bandits.tickets import Ticket, Told, ticket_from
from regraft.adaptation_manager.planners.choices.slots import Option, Slot
from regraft.bus_schema.annotations import PlainValue
from regraft.bus_schema.errors import BadMessage
from regraft.bus_schema.model.architecture import Architecture

MAX_TICKETS: Final = 32
"""Tickets of a task that are remembered; an older one cannot be credited any more."""
MAX_COUNTED: Final = 20_000
"""Options of which it is remembered how often they were chosen or failed."""
MAX_DOUBLINGS: Final = 5


@dataclass(frozen=True, slots=True)
class Chosen:
    """An option that a strategy has chosen: why, out of how many, and notes about it."""

    strategy: str
    knobs: Knobs
    option: Option
    slots: tuple[Slot, ...]
    context: dict[str, float]
    options: int
    resting: int
    why: str
    notes: tuple[str, ...] = ()


class TaskMemory:
    """All that is known for the sake of one task."""

    def __init__(self, task: str, strategies: Strategies) -> None:
        self._task = task
        self._strategies = strategies
        self._learned: dict[str, Strategy[Any]] = {}
        self._tickets: dict[str, Ticket] = {}
        self._choices: dict[str, int] = {}
        self._uncredited: dict[str, int] = {}
        self._failures: dict[str, int] = {}
        self._resting: dict[str, int] = {}
        self._issued = 0

    # --- choosing ---

    def check(self, strategy: str, knobs: Knobs, options: Sequence[Option], context: dict[str, float]) -> None:
        """Refuse knobs that do not fit the options or the context; raises BadMessage."""
        try:
            self._judge(strategy, knobs)[0].check(Offer([option.key for option in options], {}, context))
        except BadMessage as error:
            raise error.inside("knobs") from None

    def choose(
        self,
        strategy: str,
        knobs: Knobs,
        slots: tuple[Slot, ...],
        options: Sequence[Option],
        context: dict[str, float],
        seed: str,
    ) -> Chosen:
        """Choose among ``options``; nothing of what is known changes.

        Its chance depends on the seed, the task, the strategy, and the number of its choices so far.
        """
        judge, note = self._judge(strategy, knobs)
        relevant = judge.relevant(context)
        awake = [option for option in options if option.key not in self._resting] or list(options)
        offer = Offer([option.key for option in awake], self._uncredited, relevant)
        rng = Random(f"{seed}/{self._task}/{strategy}/{self._choices.get(strategy, 0)}")
        decision = judge.choose(offer, rng)
        option = awake[decision.index]
        resting = len(options) - len(awake)
        notes = (note,) if note else ()
        return Chosen(strategy, knobs, option, slots, relevant, len(options), resting, decision.why, notes)

    def _judge(self, name: str, knobs: Knobs) -> tuple[Strategy[Any], str]:
        """Return what a strategy knows, under the given knobs; a new one for another range of utility."""
        known = self._learned.get(name)
        if known is None:
            return self._strategies.new(name, knobs), ""
        before = known.knobs
        if (before.low, before.high) != (knobs.low, knobs.high):
            ranges = f"[{before.low:g}, {before.high:g}] to [{knobs.low:g}, {knobs.high:g}]"
            return self._strategies.new(name, knobs), f"{name} begins anew: the utility's range went from {ranges}"
        known.knobs = knobs
        return known, ""

    def keep(self, chosen: Chosen) -> None:
        """Take note that a choice is being carried out: the next one draws again, and others rest a turn less."""
        self._learned[chosen.strategy] = self._judge(chosen.strategy, chosen.knobs)[0]
        self._choices[chosen.strategy] = self._choices.get(chosen.strategy, 0) + 1
        self._resting = {key: turns - 1 for key, turns in self._resting.items() if turns > 1}
        for counts in (self._uncredited, self._failures):
            while len(counts) > MAX_COUNTED:
                del counts[next(iter(counts))]

    # --- what became of it ---

    def stood(self, chosen: Chosen, now: float, settle: float, *, changed: bool) -> tuple[str, float]:
        """Take note that a choice is in force from now on; returns its ticket, and when measuring its effect begins.

        Without a change, what the same choice has settled already counts.
        """
        key = chosen.option.key
        last = next(reversed(self._tickets.values()), None)
        settled = not changed and last is not None and last.key == key and last.until is None
        since = max(now, last.since) if settled and last else now + settle
        self._failures.pop(key, None)
        self._uncredited[key] = self._uncredited.pop(key, 0) + 1
        self._issued += 1
        name = f"{self._issued}-{key}"
        low, high = chosen.knobs.low, chosen.knobs.high
        self._tickets[name] = Ticket(chosen.strategy, key, since, low, high, chosen.context, chosen.option.settings)
        if len(self._tickets) > MAX_TICKETS:
            del self._tickets[next(iter(self._tickets))]
        return name, since

    def failed(self, chosen: Chosen, rest: int) -> int:
        """Take note that a choice could not be carried out; returns for how many proposals it rests.

        Those are ``rest``, and twice as many each time that it fails again.
        """
        key = chosen.option.key
        failures = self._failures.pop(key, 0) + 1
        self._failures[key] = failures
        turns: int = rest * 2 ** min(failures - 1, MAX_DOUBLINGS)
        if turns:
            self._resting[key] = turns
        return turns

    def disturbed(self, now: float) -> None:
        """Take note that from now on something other than the last choice is in force."""
        for ticket in self._tickets.values():
            if ticket.until is None:
                ticket.until = now

    # --- learning ---

    def credit(self, credit: Credit, architecture: Architecture) -> Told:
        """Credit a utility to the option that earned it, or return why not."""
        ticket = self._tickets.get(credit.ticket)
        if ticket is None:
            return Told(credit.ticket, False, credit.utility, "this ticket is not known, or too old")
        refusal = ticket.refusal(credit, architecture)
        judge = self._learned.get(ticket.strategy)
        if not refusal and (judge is None or (judge.knobs.low, judge.knobs.high) != (ticket.low, ticket.high)):
            refusal = "the strategy has begun anew since"
        if refusal or judge is None:
            return Told(credit.ticket, False, credit.utility, refusal)
        utility, clipped = ticket.scaled(credit.utility)
        try:
            judge.learn(ticket.key, utility, ticket.context)
        except CannotLearn as error:
            return Told(credit.ticket, False, credit.utility, str(error))
        ticket.credited = True
        self._uncredited.pop(ticket.key, None)
        outside = f"utility {credit.utility:g} was clipped to the range [{ticket.low:g}, {ticket.high:g}]"
        return Told(credit.ticket, True, credit.utility, notes=(outside,) if clipped else ())

    # --- keeping ---

    def state(self) -> PlainValue:
        """Return all of it as plain data."""
        return {
            "learned": {n: [_plain(s.knobs), s.state()] for n, s in self._learned.items()},
            "tickets": {name: ticket.state() for name, ticket in self._tickets.items()},
            "choices": dict(self._choices),
            "uncredited": dict(self._uncredited),
            "failures": dict(self._failures),
            "resting": dict(self._resting),
            "issued": self._issued,
        }

    def restore(self, state: PlainValue) -> None:
        """Continue from what ``state`` returned; a strategy that is not there any more is left out."""
        for name, (knobs, learned) in state["learned"].items():
            if name in self._strategies.names():
                strategy = self._strategies.new(name, self._strategies.knobs(name, knobs))
                strategy.restore(learned)
                self._learned[name] = strategy
        self._tickets = {name: ticket_from(ticket) for name, ticket in state["tickets"].items()}
        self._choices, self._uncredited = dict(state["choices"]), dict(state["uncredited"])
        self._failures, self._resting = dict(state["failures"]), dict(state["resting"])
        self._issued = state["issued"]


def _plain(knobs: Knobs) -> PlainValue:
    return asdict(knobs)
