"""The topics by which a system speaks of itself: they are always there, and components only read them."""

from __future__ import annotations

STATES = "system/states"
FAULTS = "system/faults"
DIAGNOSTICS = "system/diagnostics"
QUALITIES = "system/qualities"
MEASUREMENTS = "system/measurements"
HOSTS = "system/hosts"

SYSTEM_TOPICS = {
    STATES: "regraft/SystemStates",
    FAULTS: "regraft/SystemFaults",
    DIAGNOSTICS: "regraft/SystemDiagnostics",
    QUALITIES: "regraft/SystemQualities",
    MEASUREMENTS: "regraft/SystemMeasurements",
    HOSTS: "regraft/SystemHosts",
}
"""The message type that each carries. A robot's scope does not apply to them."""
RESERVED = "system/"
"""The begin of names that no topic of a stack may have."""
