"""Tests of the behaviour-tree engine."""
