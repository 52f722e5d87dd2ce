"""Random numbers that depend on the seed, the purpose and the moment, and on nothing else.

A sensor's noise is drawn from a generator made for that tick. Reading a sensor twice, or never, therefore
changes no other number, and a checkpoint needs no generator states: the seed and the time determine everything.
"""

import zlib

import numpy as np


def generator(seed: int, purpose: str, moment: int = 0) -> np.random.Generator:
    """Return the generator for one purpose ("lidar", "placement hydrant") at one moment (a step's number)."""
    return np.random.default_rng([seed, zlib.crc32(purpose.encode()), moment])
