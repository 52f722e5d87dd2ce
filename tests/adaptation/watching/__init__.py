"""Conditions that are watched after an adaptation, and qualities that are measured."""
