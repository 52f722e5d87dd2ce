"""Tests of what authors of missions do without a system."""
