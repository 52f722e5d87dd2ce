"""The built-in decorators."""
