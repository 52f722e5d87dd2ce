"""Rooms drawn from the seed, by a world file's rule: how many walls and boxes, how large, and how bright.

``loading`` is the way in; ``rule`` reads the rule, ``drawing`` draws, ``building`` makes MJCF of it.
"""
