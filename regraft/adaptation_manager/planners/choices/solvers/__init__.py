"""Solvers, all behind one protocol: ``exhaustive``, ``branch_and_bound``, ``cp_sat``."""
