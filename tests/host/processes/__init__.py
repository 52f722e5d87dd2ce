"""Processes are watched, started again and ended."""
