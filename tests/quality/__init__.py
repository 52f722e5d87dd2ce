"""Promises of quality requirements in the tree."""
