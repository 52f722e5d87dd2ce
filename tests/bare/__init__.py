"""A component written from docs/protocol.md alone, and proof that it takes part."""
