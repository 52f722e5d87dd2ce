"""Decisions: one description, ``decision.yaml``, of what is to be chosen and why, for any planner.

``model`` is what a file says, ``reading`` reads it, with a file for each of its sections in ``sections``. ``checking``
compares it with a stack. ``question`` puts it to the solvers, under a context. ``deciding`` is the base of the planners
that take decisions; ``measuring`` is what a choice was worth.
"""
