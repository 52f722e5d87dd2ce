"""What a hostile world may do to a running system, and what becomes of it."""
