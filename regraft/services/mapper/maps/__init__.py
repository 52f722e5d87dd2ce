"""Maps, and what a scan adds to them."""
