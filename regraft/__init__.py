"""Regraft: robots that adapt while they work. An author of components imports all that one needs from here."""

import os

# Before numpy is loaded: a robot has many small processes, and those that are forked must begin with one thread.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

from regraft.bus_schema.messages.health import Level
from regraft.bus_schema.messages.protocol.refusal_codes import RefusalCode
from regraft.bus_schema.model.description import Resources
from regraft.bus_schema.model.lifecycle import State
from regraft.component.component import Component
from regraft.component.errors import CallFailed, NotActive, RequestRefused
from regraft.component.future import Cancelled, Future
from regraft.component.goal import Goal
from regraft.component.handlers import action, every, service
from regraft.component.kit import ExclusiveSlot, Kit, Task
from regraft.component.live_ports import InputPort, OutputPort
from regraft.component.parameters import Parameter, ParameterError
from regraft.component.ports import Input, Output
from regraft.component.quality import Quality
from regraft.component.records import Records

__all__ = [
    "CallFailed",
    "Cancelled",
    "Component",
    "ExclusiveSlot",
    "Future",
    "Goal",
    "Input",
    "InputPort",
    "Kit",
    "Level",
    "NotActive",
    "Output",
    "OutputPort",
    "Parameter",
    "ParameterError",
    "Quality",
    "Records",
    "RefusalCode",
    "RequestRefused",
    "Resources",
    "State",
    "Task",
    "action",
    "every",
    "service",
]
