"""Statistics of samples, and of the differences of two."""
