"""The imports of a component's author: the base class, its declarations, the kit."""
