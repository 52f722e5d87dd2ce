"""Promises of the component kit."""
