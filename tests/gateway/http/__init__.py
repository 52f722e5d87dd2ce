"""HTTP itself: bodies, headers, refusals, the document."""
