"""Faults on a schedule, and those who decide by them: the same in every run."""
