"""Bandits: external strategies over a space of options with constraints (ReBeT's external adaptation).

``bandit_planner`` is the component, ``credit`` is the measured effect of a choice; ``memory`` is what was learned, for
each task; ``strategies`` has a file for each strategy. The options come from ``planners/choices``.
"""
