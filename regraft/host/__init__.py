"""The host: starts and supervises the components of one machine, and is the hub they connect to."""
