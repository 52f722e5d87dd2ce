"""Finds the pose at which a scan fits the map."""
