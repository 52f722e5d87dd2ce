"""The qualities of whole architectures, estimated along their connections."""
