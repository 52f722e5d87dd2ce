"""Decisions: one description, ``decision.yaml``, of what is to be chosen and why, for any planner.

``model`` is a file's content, ``reading`` reads it, with a file for each of its sections in ``sections``. ``checking``
compares it with a stack. ``question`` puts it to the solvers, in a ``situation``. ``deciding`` is the base of the
planners that take decisions, ``watching`` is when they do so by themselves. ``measuring`` is what a choice was worth.
"""
