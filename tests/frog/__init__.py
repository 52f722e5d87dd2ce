"""Promises of FROG, tried on the whole stack: real processes, real Zenoh, real MuJoCo, the real HTTP server."""
