"""Conditions of adaptations that are to be confirmed, as plain data: for bodies, files and the command line."""

from __future__ import annotations

from typing import Any, Final

HOLDING: Final[tuple[Any, ...]] = (
    "Steady",
    {"requirement": "Steady"},
    {"quality": "gauge.level", "at_least": 4},
    {"quality": "gauge.level", "at_most": 9.5, "unknown_for": 20},
    {"quality": "gauge.level", "at_least": 0, "at_most": 10},
    {"quality": "gauge.level", "within": [0.0, 10]},
    {"component": "gauge", "state": "active"},
    {"require": "gauge.level <= gauge.shown and gauge.active"},
    {"require": "gauge.works and gauge.wears == 0", "unknown_for": 15.5},
)
"""Every form that there is, true of a gauge that shows 5 m and a requirement that is met."""
MALFORMED: Final[tuple[tuple[Any, str, str], ...]] = (
    ({"quality": "gauge.level"}, "", "must have bounds"),
    ({"quality": "level", "at_least": 1}, "quality", "must be 'component.quality'"),
    ({"quality": "a.b", "at_leas": 1}, "", "did you mean 'at_least'?"),
    ({"qualty": "a.b", "at_least": 1}, "", "did you mean 'quality'?"),
    ({"quality": "a.b", "at_least": 3, "at_most": 1}, "at_least", "must be at most the upper bound, 1"),
    ({"quality": "a.b", "at_least": "much"}, "at_least", "must be a number"),
    ({"quality": "a.b", "within": [1]}, "within", "must have two"),
    ({"quality": "a.b", "within": [1, 2], "at_most": 3}, "within", "no place next to at_least"),
    ({"quality": "a.b", "at_least": float("nan")}, "at_least", "must be a finite number"),
    ({"quality": "a.b", "at_least": 1, "unknown_for": -1}, "unknown_for", "must be at least 0"),
    ({"quality": "a.b", "at_least": 1, "require": "a.b > 1"}, "", "must have one of"),
    ({"component": "a"}, "state", "is missing, must be one of: unconfigured"),
    ({"component": "a", "state": "activating"}, "state", "is 'activating', must be one of: unconfigured, inactive"),
    ({"component": "a", "state": "finalized"}, "state", "must be one of: unconfigured, inactive, active"),
    ({"component": "a", "state": "actve"}, "state", "one of: unconfigured, inactive, active; did you mean 'active'?"),
    ({"requirement": "A", "unknown_for": 1}, "unknown_for", "no place next to 'requirement'"),
    ({"require": "speed > 1"}, "require", "'speed' is no 'component.parameter'"),
    ({"require": "a.b * 2"}, "require", "a.b * 2 is a number, must be true or false, such as: a.b * 2 > 0"),
    ({"require": "a.b >"}, "require", "is no expression"),
    ({}, "", "has none of them"),
    (3, "", "must be a map"),
)
"""Conditions that mean nothing: the field below the condition, empty for the condition itself, and the problem."""
UNKNOWN: Final[tuple[tuple[Any, str, str], ...]] = (
    ("Stedy", "", "no report of a quality requirement 'Stedy'"),
    ({"quality": "gauges.level", "at_least": 1}, "quality", "did you mean 'gauge'?"),
    ({"quality": "gauge.levle", "at_least": 1}, "quality", "did you mean 'level'?"),
    ({"quality": "gauge.level", "at_least": 11}, "quality", "can never be at least 11: gauge.level has"),
    ({"component": "gague", "state": "active"}, "component", "did you mean 'gauge'?"),
    ({"require": "gauge.shwn > 0.5"}, "require", "did you mean 'shown'?"),
    ({"require": "gauge.level < 'a'"}, "require", "gauge.level is a number, and is compared with the text 'a'"),
    ({"require": "gauge.active > 3"}, "require", "gauge.active is true or false, and is compared with 3"),
)
"""Conditions over what is not there, or of the wrong kind."""
