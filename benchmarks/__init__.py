"""Every budget, as a ratio against a baseline measured side by side with it: ``python -m benchmarks``."""
