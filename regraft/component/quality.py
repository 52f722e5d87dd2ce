"""Declaring the qualities of a component: what its ``evaluate`` and ``estimate`` speak of."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Literal

from regraft.bus_schema.model.qualities.qualities import Better, QualityDescription


class PartlyMeasured(Exception):
    """Raised by an ``evaluate`` that measures several parts: some of them raised, and the others' values count.

    ``errors`` has the exception for each quality that is unknown because of it, by its name.
    """

    def __init__(self, values: Mapping[str, float], errors: Mapping[str, Exception]) -> None:
        super().__init__(f"not measured: {', '.join(errors)}")
        self.values, self.errors = values, errors


class Quality:
    """A quality that a component's ``evaluate`` measures, that its ``estimate`` predicts, or both.

    >>> from regraft import Component, Quality
    >>> class Drive(Component):
    ...     "Drives."
    ...     safety = Quality("the share of the time that it is slow where it has to be", better="higher", maximum=1.0)
    ...     drive_time = Quality("of a whole drive", unit="s", better="lower", minimum=0.0, measured=False)
    """

    def __init__(
        self,
        description: str = "",
        *,
        unit: str = "1",
        better: Literal["higher", "lower", "neither"] = "neither",
        minimum: float | None = None,
        maximum: float | None = None,
        functional: bool = False,
        measured: bool = True,
        estimated: bool = True,
        name: str = "",
    ) -> None:
        """Declare a quality.

        Args:
            description: what it is.
            unit: in SI symbols; ``1`` for ratios and counts.
            better: whether more of it is better, or less.
            minimum: the least value that it can have; a lesser one counts as unknown.
            maximum: the greatest value that it can have.
            functional: whether it is about what the component does, rather than how, or at what cost.
            measured: whether ``evaluate`` gives it.
            estimated: whether ``estimate`` gives it.
            name: its name, where the attribute cannot have that: a port or a parameter has it already.

        Raises:
            ValueError: ``better`` is another word, a bound is no finite number, or nothing lies between them.
        """
        for word, bound in (("minimum", minimum), ("maximum", maximum)):
            if bound is not None and not math.isfinite(bound):
                raise ValueError(f"{word}={bound}: must be a finite number, or None where there is no bound")
        if minimum is not None and maximum is not None and minimum > maximum:
            raise ValueError(f"minimum={minimum:g}: must be at most maximum={maximum:g}")
        if better not in {each.value for each in Better}:
            raise ValueError(f"better={better!r}: must be one of {', '.join(each.value for each in Better)}")
        if not measured and not estimated:
            raise ValueError("measured=False, estimated=False: one of them must give the quality")
        self._described = QualityDescription(
            name, unit, Better(better), minimum, maximum, functional, measured, estimated, description
        )

    def __set_name__(self, owner: type, name: str) -> None:
        if not self.name:
            self._described = replace(self._described, name=name)

    @property
    def name(self) -> str:
        """The quality's name."""
        return self._described.name

    def renamed(self, name: str) -> Quality:
        """Return the same quality under another name."""
        other = object.__new__(Quality)
        other._described = replace(self._described, name=name)
        return other

    def describe(self) -> QualityDescription:
        """Return the quality's description."""
        return self._described
