"""The description of a component that does not run yet, asked of its class in a process of its own."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

from regraft.bus_schema.encoding import codec
from regraft.bus_schema.model.architecture import ComponentSpec
from regraft.stack.describing import Surroundings, describe_component


def be_describer(order: dict[str, Any]) -> int:
    """Write what a spec would be to the file that the order names; for a process of its own."""
    spec = codec.from_plain(order["spec"], ComponentSpec)
    surroundings = Surroundings(Path(order["stack_folder"]), order["folder"], order["references"])
    described = describe_component(spec, surroundings)
    partial = f"{order['answer']}.part"
    Path(partial).write_bytes(codec.encode(described))
    os.replace(partial, order["answer"])
    return 0
