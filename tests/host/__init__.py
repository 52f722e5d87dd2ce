"""Promises of the host, tried on real processes."""
