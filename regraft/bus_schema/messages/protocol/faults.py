"""The protocol of faults on a schedule: the source of time asks the first host, and that one the component."""

from __future__ import annotations

from dataclasses import dataclass

from regraft.bus_schema.annotations import Count, Told
from regraft.bus_schema.encoding.registry import message
from regraft.bus_schema.model.scheduled_faults import ScheduledFault


@message("regraft/InjectFault")
@dataclass(frozen=True, slots=True)
class InjectFault:
    """A host is to make one of its components fail; one whose run ends is not restarted before `BringBack`, if
    ``held``.
    """

    fault: ScheduledFault
    held: bool = False


@message("regraft/BringBack")
@dataclass(frozen=True, slots=True)
class BringBack:
    """A host is to restart a component that it holds back."""

    component: str


@message("regraft/FaultInjected")
@dataclass(frozen=True, slots=True)
class FaultInjected:
    """The outcome of a fault: the run concerned, why it ended, and whether there will be another;
    ``quarantined``: it had ended too often.

    ``ended`` is empty if the run continues. ``missed`` is why nothing has happened, empty if it has.
    ``certain`` is false if the component has not answered: it may be otherwise in another run.
    """

    component: str
    incarnation: Count
    ended: str = ""
    comes_back: bool = False
    quarantined: bool = False
    missed: Told = ""
    certain: bool = True
