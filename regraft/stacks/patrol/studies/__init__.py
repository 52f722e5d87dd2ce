"""The patrol's studies: `regraft evaluate patrol-managers` and `patrol-qualities`."""
