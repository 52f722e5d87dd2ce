"""The offers of hosts, and the components placed by them."""
