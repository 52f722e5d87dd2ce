"""Designs as modes of the stack: what each claims, the changes that enter them, and what to learn from failures."""
