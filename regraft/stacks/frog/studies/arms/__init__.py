"""The arms of evaluation B, the scenarios that they are compared in, and the columns of their results."""
