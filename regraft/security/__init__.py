"""Admission to a system: secrets, certificates, the gate of the first host, access tokens."""
