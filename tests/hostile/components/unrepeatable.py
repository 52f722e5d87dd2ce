"""Components that read clocks and chance of their own."""

from __future__ import annotations

import random
import time
import uuid
from random import choice
from time import monotonic

import numpy as np

from regraft import Component, every


class Restless(Component):
    """Reads whatever differs from run to run, again and again."""

    @every(hz=1)
    def read(self) -> None:
        self.read_now = time.time()
        self.since = monotonic()
        self.dice = random.random()
        self.side = choice("ab")
        self.noise = np.random.rand()
        self.name = uuid.uuid4()

    @every(hz=1)
    def read_as_one_should(self) -> None:
        self.at = self.kit.now()
        self.own = random.Random(self.kit.seed).random()
        self.other = np.random.default_rng(self.kit.seed).random()
        self.took = time.perf_counter()
