"""What a first host knows of the hosts that have joined it."""
