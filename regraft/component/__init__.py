"""What the author of a component imports: the base class, its declarations, the kit."""
