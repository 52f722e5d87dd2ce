"""A patrol with the published components, as processes that fail and recover when a test wants it."""
