"""The qualities of an architecture before and after changes, estimated by its classes in a process of its own."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from regraft.bus_schema.annotations import PlainValue
from regraft.bus_schema.encoding import codec
from regraft.bus_schema.messages.protocol.host import EstimatedQualities, EstimateQualities
from regraft.bus_schema.model.architecture import ComponentSpec
from regraft.bus_schema.model.qualities.estimates import Figure
from regraft.bus_schema.model.qualities.qualities import Judged, all_unknown, estimated
from regraft.component.component import InputQualities
from regraft.estimation.calling import Call, call_within_bounds
from regraft.estimation.estimation import Estimation

UNDER_WAY = ".under_way"
"""Suffix of the file with the component whose estimator is being called: it may end the process."""


def be_estimator(order: dict[str, Any]) -> int:
    """Write the estimates to the file that the order names; for a process of its own."""
    answer = Path(order["answer"])
    under_way, left_out = answer.with_suffix(UNDER_WAY), order["left_out"]

    def call(spec: ComponentSpec, context: Mapping[str, PlainValue], inputs: InputQualities) -> Judged:
        assert spec.description is not None
        if spec.name in left_out:
            return all_unknown(estimated(spec.description.qualities), left_out[spec.name])
        under_way.write_text(spec.name)
        return call_within_bounds(spec, context, inputs)

    found = estimates(codec.from_plain(order["estimate"], EstimateQualities), call)
    under_way.unlink(missing_ok=True)
    partial = f"{answer}.part"
    Path(partial).write_bytes(codec.encode(found))
    os.replace(partial, answer)
    return 0


def estimates(wanted: EstimateQualities, call: Call) -> EstimatedQualities:
    """Return the figures of both architectures."""
    before, after = ({spec.name: spec for spec in specs} for specs in (wanted.before, wanted.after))
    now = Estimation(before, wanted.context, wanted.measured, call)
    return EstimatedQualities(_plain(now), _plain(now.changed(after)))


def _plain(estimation: Estimation) -> dict[str, dict[str, Figure]]:
    return {name: dict(figures) for name, figures in estimation.figures.items()}
