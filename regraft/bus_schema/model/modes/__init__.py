"""Modes: what they set, whose they are, the rules that enter them."""
