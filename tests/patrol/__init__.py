"""The patrol under metacontrol, and its studies."""
