"""HTTP without a robot: bodies, problems, callers and roles, what a request may ask for, the OpenAPI document."""
