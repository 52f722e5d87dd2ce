"""Both sides of each measurement: ours, and the baseline."""
