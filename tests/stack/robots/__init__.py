"""Robots in stack files."""
