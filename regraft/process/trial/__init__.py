"""Tries authors' modules in a process of their own, before they are imported."""
