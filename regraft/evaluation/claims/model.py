"""The claims of a study, as its file has them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum

from regraft.evaluation.statistics.paired import Direction, SampleTest


class SeedSet(Enum):
    """The use of a seed: for tuning and never reported, for the report, or for the one confirmation at the end."""

    TUNING = "tuning"
    REPORTING = "reporting"
    CONFIRMATION = "confirmation"


@dataclass(frozen=True, slots=True)
class Claim:
    """One claim: that in a ``scenario`` the arm ``first`` has more, less or as much of ``measure`` than ``second``.

    ``smallest_effect`` is the difference of the means that is worth having, in the measure's unit. ``expected``
    is that difference on tuning seeds, ``sd`` the standard deviation there: of differences of equal seeds, or a sample.
    The number of seeds follows from them.
    ``refuted_by`` states in words which result would refute it.
    """

    name: str
    text: str
    family: str
    scenario: str
    measure: str
    first: str
    second: str
    direction: Direction
    smallest_effect: float
    expected: float
    sd: float
    test: SampleTest
    refuted_by: str


@dataclass(frozen=True, slots=True)
class Claims:
    """All claims of a study by some definitions.

    ``alpha`` is the error that each family as a whole may have. ``power`` is the least probability of finding what is
    expected. ``seeds`` have no seed in common.
    """

    file: str
    study: str
    definitions: str
    alpha: float
    power: float
    seeds: Mapping[SeedSet, tuple[int, ...]]
    claims: tuple[Claim, ...]

    def family(self, name: str) -> tuple[Claim, ...]:
        """Return the claims that are corrected together."""
        return tuple(claim for claim in self.claims if claim.family == name)

    def alpha_of(self, claim: Claim) -> float:
        """Return the one-sided error of one claim, by which its family as a whole keeps its own (Bonferroni)."""
        return self.alpha / len(self.family(claim.family))

    def set_of(self, seed: int) -> SeedSet | None:
        """Return the use of a seed, None if it has none."""
        return next((which for which, seeds in self.seeds.items() if seed in seeds), None)
