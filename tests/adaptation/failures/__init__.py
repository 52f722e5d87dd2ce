"""Adaptations that fail on the way, and how they are undone."""
