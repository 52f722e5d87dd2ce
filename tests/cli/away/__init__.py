"""Components and hosts that are silent, absent or elsewhere."""
