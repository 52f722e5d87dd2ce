"""The metacontroller."""
