"""Qualities of components: declared, measured, published, and unknown wherever they cannot be trusted."""
