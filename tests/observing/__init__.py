"""Tests of counts and recordings of missions."""
