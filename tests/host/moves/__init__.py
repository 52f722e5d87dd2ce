"""Components move between hosts."""
