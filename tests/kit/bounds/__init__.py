"""Bounds on what a component keeps, however long it runs and whatever comes in."""
