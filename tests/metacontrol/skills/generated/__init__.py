"""Tests of what is generated from skills."""
