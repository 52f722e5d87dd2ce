"""The runs of components that a host has: present, standing by, past."""
