"""Sensing and estimates at length."""
