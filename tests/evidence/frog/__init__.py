"""FROG at length."""
