"""What is measured, and the baselines beside it."""
