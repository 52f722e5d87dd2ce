"""Observers: what they publish, and when."""
