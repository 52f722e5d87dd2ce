"""Conditions about the error code that an action has left, with the numbers of Nav2's actions."""

from collections.abc import Collection
from typing import Any, ClassVar

from ...nodes.leaf import Condition
from ...nodes.node import Node
from ...nodes.ports import Input


class AreErrorCodesPresent(Condition):
    """Holds while an error code is one of some; an unset code is 0, no error."""

    error_code = Input(int, description="the code")
    error_codes_to_check = Input[Any](description="the codes to compare with, as 101;107;119 or a list")

    codes: ClassVar[Collection[int]] = ()
    """The codes where the port is left open."""

    def adopt(self, children: tuple[Node, ...]) -> None:
        """Check codes that are given as a literal; see `Node.adopt`."""
        super().adopt(children)
        if self.has_literal("error_codes_to_check"):
            self._codes()

    def holds(self) -> bool:
        """Return whether the code is one of them."""
        return self.read_port_or("error_code", 0) in self._codes()

    def _codes(self) -> Collection[int]:
        given = self.read_port_or("error_codes_to_check")
        if given is None:
            return self.codes
        parts = [part for part in given.split(";") if part.strip()] if isinstance(given, str) else given
        try:
            return {int(part) for part in parts}
        except (TypeError, ValueError):
            raise ValueError(f"error_codes_to_check is {given!r}; it needs whole numbers, as 101;107") from None


class WouldAControllerRecoveryHelp(AreErrorCodesPresent):
    """Holds for errors of FollowPath that clearing, turning or waiting may remove."""

    codes = (100, 104, 105, 106)


class WouldAPlannerRecoveryHelp(AreErrorCodesPresent):
    """Holds for errors of ComputePathToPose and ComputePathThroughPoses that may be gone after a recovery."""

    codes = (200, 207, 208, 300, 307, 308)


class WouldARouteRecoveryHelp(AreErrorCodesPresent):
    """Holds for errors of ComputeRoute and ComputeAndTrackRoute that may be gone after a recovery."""

    codes = (400, 404, 405)


class WouldASmootherRecoveryHelp(AreErrorCodesPresent):
    """Holds for errors of SmoothPath that may be gone after a recovery."""

    codes = (500, 502, 503, 504)
