"""The grammar of the language, and models from texts."""
