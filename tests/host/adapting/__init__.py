"""Adaptations on real processes, and kills amid them."""
