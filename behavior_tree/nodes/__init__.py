"""The bases of all nodes, their ports, and one tick of any of them."""
