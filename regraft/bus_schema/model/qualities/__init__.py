"""Qualities that classes declare, and their estimates."""
