"""Reads trees from BehaviorTree.CPP's XML, version 4."""
