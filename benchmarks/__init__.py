"""Every budget as a ratio against a baseline, both measured side by side in one run: ``python -m benchmarks``."""
