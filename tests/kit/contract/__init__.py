"""The promises of both buses."""
