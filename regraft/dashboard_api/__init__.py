"""The gateway: a component that shows a running system over HTTP and takes adaptations."""
