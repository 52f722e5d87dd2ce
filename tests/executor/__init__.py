"""Tests of the mission executor and its leaves."""
