"""The hand-over from one run of a component to the next."""
