"""Tests of the system reflection, and of ports by parameters, which it is made of."""
