"""SUAVE's pipeline inspection under the metacontroller: stub components that replay its contingencies."""
