"""The content of the bus: keys, messages, codec, envelope, and the data types of components and adaptations.

Nothing here does any input or output; everything else is built on it.
"""
