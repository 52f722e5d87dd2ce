"""Messages to bytes and back: shapes, records, the registry of types, the codec, the envelope of a sample."""
