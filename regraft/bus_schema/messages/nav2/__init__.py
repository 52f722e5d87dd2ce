"""The requests and answers of Nav2's servers: paths, motions, whole drives, routes."""
