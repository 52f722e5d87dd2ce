"""Plans that are written in the tree: rule tables, and what they ask for."""
