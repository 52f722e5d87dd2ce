"""Tests of what a component class declares."""
