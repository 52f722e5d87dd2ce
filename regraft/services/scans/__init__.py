"""Components that make or pass on laser scans, so that a robot can drive by one sensor or by another."""
