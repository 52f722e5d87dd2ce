"""Analysis and plan of the metacontroller."""
