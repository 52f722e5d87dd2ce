"""What strangers put on the bus."""
