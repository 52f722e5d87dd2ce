"""Messages that strangers put on the bus."""
