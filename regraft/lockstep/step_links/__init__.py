"""Steps and acknowledgements between processes of one machine, past the bus."""
