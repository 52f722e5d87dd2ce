"""Regraft: robots that adapt while they work. This is the kit that a component's author imports."""

import os

# Before numpy is loaded: a robot has many small processes, and those that are forked must begin with one thread.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

from bus_schema.messages.requests import RefusalCode
from regraft.component import Component
from regraft.parameters import Parameter
from regraft.ports import Input, Output
from regraft.records import Records
from regraft.requests import action, every, service
from regraft.runtime.calling import CallFailed
from regraft.runtime.serving import RequestRefused
from regraft.runtime.tasks import Cancelled

__all__ = [
    "CallFailed",
    "Cancelled",
    "Component",
    "Input",
    "Output",
    "Parameter",
    "Records",
    "RefusalCode",
    "RequestRefused",
    "action",
    "every",
    "service",
]
