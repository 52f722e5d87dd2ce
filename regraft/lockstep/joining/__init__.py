"""Joining simulated time: requests, gathering, admission."""
