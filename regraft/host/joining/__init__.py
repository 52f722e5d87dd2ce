"""A first host's view of the hosts that have joined it."""
