"""The mode planner: enforces the rules of a stack by entering modes.

``enforcement`` decides by what is known, ``situation`` reads what conditions speak of, ``mode_planner`` is the
component.
"""
