"""Choosing what should be: slots, alternatives, constraints, an objective, and solvers behind one protocol.

``slots`` is what there is to choose, ``settings`` what an alternative means. ``in_architecture`` is what of it is in
force, and which changes lead to it. ``rules`` and ``constraints`` are what goes together, ``space`` all that is
allowed. ``objective`` is what an option is worth; ``problem`` is all of this as numbers, for the ``solvers``.
``choosing`` puts them together, and explains what was chosen.
"""
