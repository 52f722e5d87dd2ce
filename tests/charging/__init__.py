"""Tests of docking and charging."""
