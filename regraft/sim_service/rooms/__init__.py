"""Rooms and rings of corridors drawn from the seed, by a world file's rule: what stands there, how large, how bright.

``loading`` is the way in. ``words`` reads the words of any rule, and ``building`` makes MJCF of what was drawn. For
rooms ``rule`` has the words and ``drawing`` draws, for corridors ``corridor_rule`` and ``corridors``.
"""
