"""What Nav2's servers are asked and answer: paths, motions, whole drives, routes."""
