"""The nodes and trees of Nav2."""
