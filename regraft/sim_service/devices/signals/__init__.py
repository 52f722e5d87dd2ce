"""Devices that reach others: beacons, lamps, sound and radio."""
