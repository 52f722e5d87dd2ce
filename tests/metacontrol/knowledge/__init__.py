"""The knowledge base and its rules."""
