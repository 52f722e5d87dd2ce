"""Hosts join, are trusted or not, and are lost."""
