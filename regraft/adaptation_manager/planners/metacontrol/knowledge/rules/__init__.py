"""The rule engine: Horn rules over facts, and a forward chainer that keeps each derivation."""
