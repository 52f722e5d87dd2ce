"""Choices and their solvers."""
