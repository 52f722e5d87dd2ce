"""The pages that the gateway shows."""
