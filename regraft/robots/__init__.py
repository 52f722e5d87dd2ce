"""Robots: a folder each, with the MJCF file, devices and components."""
