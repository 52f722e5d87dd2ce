"""Promises of the patrol over many seeds."""
