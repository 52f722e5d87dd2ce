"""Bandits: external strategies over a space of options with constraints (ReBeT's external adaptation).

``planner`` is the component, ``inputs`` what it is asked; ``dimensions``, ``constraints``, ``search`` and ``space``
are the options that there are, ``standing`` what they mean in an architecture; ``memory`` is what was learned, for
each task; ``strategies`` has a file for each strategy.
"""
