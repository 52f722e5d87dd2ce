"""Maps, and what a scan says of them."""
