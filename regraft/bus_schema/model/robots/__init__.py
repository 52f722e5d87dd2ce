"""Several robots in one system: the scopes of their names, and what belongs to each."""
