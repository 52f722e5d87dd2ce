"""The runs of components that a host has: present, standby, past."""
