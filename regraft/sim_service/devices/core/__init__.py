"""The common parts of all devices: their base, their kit, failures, and how they are fitted to a world."""
