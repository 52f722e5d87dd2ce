"""Typed values, and the blackboards that hold them."""
