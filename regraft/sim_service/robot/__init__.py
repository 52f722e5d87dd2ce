"""The simulated robot: its drive, its sensors, and their failures."""
