"""Classes and stacks that break."""
