"""Helps authors of missions without a system: models for editors, drawings, dry runs, conversions."""
