"""Calling an estimator: an author's class method, which may raise, and in a process of its own may hang."""

from __future__ import annotations

import signal
from collections.abc import Callable, Mapping
from types import FrameType

from regraft.bus_schema.annotations import PlainValue
from regraft.bus_schema.model.architecture import ComponentSpec
from regraft.bus_schema.model.qualities.qualities import Judged, all_unknown, estimated
from regraft.bus_schema.texts import told
from regraft.component.component import InputQualities
from regraft.component.predicting import predicted
from regraft.process.main import load_class

Call = Callable[[ComponentSpec, Mapping[str, PlainValue], InputQualities], Judged]
"""Asks a component's class for its estimates, given a context and what feeds it; never raises."""

MAX_SECONDS = 2.0
"""Seconds that an estimator may take in `call_within_bounds`."""


def call(spec: ComponentSpec, context: Mapping[str, PlainValue], inputs: InputQualities) -> Judged:
    """Call an estimator in this process; anything that it raises makes its figures unknown."""
    assert spec.description is not None
    described = spec.description.qualities
    parameters = {parameter.name: parameter.default for parameter in spec.description.parameters} | spec.parameters
    try:
        return predicted(load_class(spec.cls), described, parameters, context, inputs)
    except Exception as error:
        return all_unknown(estimated(described), f"estimate raised {told(error)}"[:500])


class _TooSlow(BaseException):
    """An estimator took too long. It passes through ``except Exception``."""


def call_within_bounds(spec: ComponentSpec, context: Mapping[str, PlainValue], inputs: InputQualities) -> Judged:
    """Call an estimator that may hang or exit; for the main thread of a process that does nothing else."""
    assert spec.description is not None
    before = signal.signal(signal.SIGALRM, _too_slow)
    signal.setitimer(signal.ITIMER_REAL, MAX_SECONDS)
    try:
        return call(spec, context, inputs)
    except _TooSlow:
        why = f"estimate took longer than {MAX_SECONDS:g} s"
    except BaseException as error:
        why = f"estimate raised {told(error)}"
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, before)
    return all_unknown(estimated(spec.description.qualities), why)


def _too_slow(_: int, __: FrameType | None) -> None:
    raise _TooSlow
