"""The messages of the protocol between components, hosts and the source of time (docs/protocol.md)."""
