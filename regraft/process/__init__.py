"""The process of one component: how it starts, what it imports, how it ends."""
