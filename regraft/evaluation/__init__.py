"""Evaluation: recording runs, and what to make of them."""
